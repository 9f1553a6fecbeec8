"""The range of an image's values: what is white, what is refused, and what is a warning."""

import warnings

import made
import numpy as np
import pytest
import skep
from skep import _images

CAMERA = skep.Camera([[10, 0, 4], [0, 10, 3], [0, 0, 1]])
BYTES = np.random.default_rng(4).integers(0, 256, (6, 8, 3), dtype=np.uint8)
BYTES[0, 0] = 0, 255, 128


def colors(image: np.ndarray, **arguments: float) -> np.ndarray:
    """The colors that the library keeps of an image, by fusing a plane with it."""
    depth, normal = np.full((6, 8), 2.0, np.float32), np.tile(np.float32([0, 0, -1]), (6, 8, 1))
    options = skep.Options(fusion_min_agreeing_views=0, fusion_compensate_exposure=False)
    cloud = skep.fuse([skep.FusionView(CAMERA, depth, normal, image, **arguments)], options)
    place = np.round(cloud.positions[:, :2] / 2 * 10 + [4, 3]).astype(int)
    found = np.empty((6, 8, 3), np.uint8)
    found[place[:, 1], place[:, 0]] = cloud.colors
    assert len(cloud) == 48
    return found


def test_the_same_picture_in_every_range_gives_the_same_pixels():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for image, white in [
            (BYTES, None),
            ((BYTES / 255).astype(np.float32), None),
            ((BYTES / 255).astype(np.float32), 1),
            (BYTES.astype(np.float32), 255),
            (BYTES.astype(np.float32) * 16, 4080.0),
            (BYTES.astype(np.uint16) * 257, None),
            (BYTES.astype(np.uint16) * 257, 65535),
            (np.round(BYTES * (4095 / 255)).astype(np.uint16), 4095),
            (BYTES.astype(">u2"), 255),
            (BYTES[::-1].astype(np.float32)[::-1], 255),
        ]:
            assert np.array_equal(colors(image, white=white), BYTES), (image.dtype, white)


def test_floats_beyond_white_are_refused_with_the_value_and_the_remedy():
    image = BYTES.astype(np.float32)
    for given, white, words in [
        (image, None, "largest value of the float32 image is 255: must be at most 1; .*white=255"),
        (image, 100, "is 255: must be at most 100"),
        (image * 100, None, "white=25500"),
        (image / 255 - 0.5, None, "smallest value of the float32 image is -0.5: must be at least 0"),
        (np.where(image == 255, np.inf, 0).astype(np.float32), None, "is inf"),
        (BYTES.astype(np.uint16), 200, "largest value of the uint16 image is 255: must be at most 200"),
        (image, 0, "white is 0"),
        (image, float("nan"), "white is nan"),
        (np.where(np.arange(8)[:, None] == 5, np.float32(np.nan), image), 255, "column 5, row 0 is not a"),
    ]:
        scene = skep.Scene()
        with pytest.raises(skep.ArgumentError, match=words):
            scene.add_view(given, CAMERA, white=white)
        with pytest.raises(skep.ArgumentError, match=words):
            skep.PackedImage(given, white=white)
        assert len(scene) == 0


def test_what_interpolation_leaves_just_outside_is_clamped_and_a_fourth_channel_ignored():
    image = (BYTES / 255).astype(np.float32)
    image[0, 0] = -0.003, 1.003, 128 / 255
    assert np.array_equal(colors(image), BYTES)
    for fourth in (1000, np.nan):
        with_fourth = np.dstack([image, np.full((6, 8), fourth, np.float32)])
        assert np.array_equal(colors(with_fourth), BYTES)
        assert np.array_equal(colors(with_fourth * np.float32(255), white=255), BYTES)


def test_16_bits_that_look_like_fewer_are_a_warning_in_the_line_of_the_user():
    twelve = BYTES.astype(np.uint16) * 16
    for call in (
        lambda image: skep.Scene().add_view(image, CAMERA),
        skep.PackedImage,
        colors,
    ):
        with pytest.warns(
            UserWarning, match="is 4080, nearly black: pass white=4095 if it has 12 bits"
        ) as told:
            call(twelve)
        assert len(told) == 1
        assert told[0].filename == __file__
    with pytest.warns(UserWarning, match="white=1023 if"):
        skep.PackedImage(BYTES.astype(np.uint16) * 4)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        skep.PackedImage(twelve, white=65535)
        skep.PackedImage(np.zeros((6, 8), np.uint16))
        skep.PackedImage(twelve * 2)


def test_a_scene_warns_of_depth_ranges_that_no_point_supports():
    scene = made.scene()
    assert scene.warnings == ()
    scene.add_points(*made.points())
    scene.set_depth_range(2, None)
    assert scene.warnings == ()
    scene.add_view(made.photographs()[0].image, made.photographs()[0].camera, name="new.png")
    (warning,) = scene.warnings
    assert "new.png saw no sparse point" in warning
    with pytest.raises(skep.ArgumentError):
        skep.Scene().warnings


def test_values_are_read_where_they_are_with_the_white_of_their_type():
    image = (BYTES / 255).astype(np.float32)
    assert _images.image(image, "rgb", 1).array is image
    assert _images.image(image * 255, "rgb", 255).array.dtype == np.uint8
