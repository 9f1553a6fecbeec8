"""Scenes and options: stored values and errors."""

import made
import numpy as np
import pytest
import skep
from skep import _images

GRAY = np.zeros((6, 8), dtype=np.uint8)
CAMERA = skep.Camera([[10, 0, 4], [0, 10, 3], [0, 0, 1]])


def test_a_scene_tells_what_it_was_given():
    scene = skep.Scene()
    truth = made.photographs()
    for number, photograph in enumerate(truth):
        assert scene.add_view(photograph.image, photograph.camera, name=f"ü{number}.png") == number
    assert (
        len(scene) == len(truth) and scene.name(1) == "ü1.png" and scene.size(1) == (made.WIDTH, made.HEIGHT)
    )
    camera = scene.camera(2)
    for name in ("K", "R", "t", "center"):
        np.testing.assert_allclose(getattr(camera, name), getattr(truth[2].camera, name), rtol=1e-12)
    positions, views = made.points()
    scene.add_points(positions, views)
    near, far = scene.depth_range(0)
    assert near < truth[0].depth.min() and truth[0].depth.max() < far
    assert set(scene.sources(0)) <= set(scene.overlap(0)) == set(range(1, len(truth)))
    cosine = scene.camera(0).center @ scene.camera(1).center
    cosine /= np.linalg.norm(scene.camera(0).center) * np.linalg.norm(scene.camera(1).center)
    assert abs(scene.triangulation_angle(0, 1) - np.degrees(np.arccos(cosine))) < 3
    scene.set_sources(0, [3, 1])
    scene.set_depth_range(0, (1.5, 9.0))
    assert scene.sources(0) == (3, 1) and scene.depth_range(0) == (1.5, 9.0)
    scene.set_sources(0, None)
    scene.set_depth_range(0, None)
    assert len(scene.sources(0)) > 2 and scene.depth_range(0) == (near, far)
    scene.validate()


def test_answers_follow_the_changes_of_a_scene():
    scene = skep.Scene()
    for x in range(4):
        camera = skep.Camera(CAMERA.K, t=[-0.2 * x, 0, 0])
        scene.add_view(GRAY, camera, depth_range=(1.0, 4.0))
    assert scene.overlap(0) == (1, 2, 3)
    scene.add_points([[0.0, 0, 3], [0.5, 0, 3]], [[0, 1], [2, 3]])
    assert scene.overlap(0) == (1,)
    scene.add_view(GRAY, CAMERA, depth_range=(1.0, 4.0))
    assert scene.overlap(0) == (1, 4) and scene.overlap(4) == (0, 1, 2, 3)


def test_masked_pixels_have_no_depth_and_say_why():
    scene = made.scene()
    mask = np.ones((made.HEIGHT, made.WIDTH + 3), dtype=bool)[:, 3:]
    mask[:30, 10:40] = False
    scene.set_mask(0, mask)
    options = skep.Options(scales="downscale=1 food_sources=3 iterations=1+1x1")
    masked = skep.reconstruct(scene, options)[0]
    assert np.array_equal(masked.status == skep.PixelStatus.MASKED, ~mask)
    assert not masked.depth[~mask].any() and masked.depth[mask].all()
    scene.set_mask(0, None)
    assert skep.reconstruct(scene, options)[0].depth.all()


def test_a_view_that_is_refused_is_not_added():
    scene = skep.Scene()
    for arguments, words in [
        ({"mask": np.ones((5, 8), dtype=np.uint8)}, "mask has shape"),
        ({"mask": np.ones((6, 8), dtype=np.float32)}, "mask has type"),
        ({"depth_range": (3.0, 2.0)}, "2"),
        ({"depth_range": (float("nan"), 2.0)}, "NaN"),
        ({"order": "gbr"}, "order 'gbr'"),
        ({"name": "a\0b"}, "NUL"),
    ]:
        with pytest.raises(skep.ArgumentError, match=words):
            scene.add_view(GRAY, CAMERA, **arguments)
    for image in (GRAY[:0], GRAY[0], np.zeros((6, 8, 2), np.uint8), GRAY.astype(float), GRAY.astype(bool)):
        with pytest.raises(skep.ArgumentError, match="image has"):
            scene.add_view(image, CAMERA)
    assert len(scene) == 0
    assert scene.add_view(GRAY, CAMERA, mask=GRAY == 0, depth_range=(1.0, 2.0)) == 0
    assert scene.name(0) == "view0000.png"


def test_rows_without_gaps_are_read_where_they_are():
    large = np.zeros((40, 50, 3), dtype=np.uint8)
    deep, gray = large.astype(np.uint16), large[:, :, 0].copy()
    for there in (large, large[3:9, 4:20], large[::2, 10:], large[:1], deep[5:, 5:], gray):
        assert _images.image(there, "rgb").array.ctypes.data == there.ctypes.data
    for elsewhere in (
        large[::-1],
        large[:, ::2],
        large[:, :, 0],
        large.transpose(1, 0, 2),
        large.astype(">u2"),
    ):
        given = _images.image(elsewhere, "rgb")
        assert given.array.flags.c_contiguous and np.array_equal(given.array, elsewhere)
    frozen = large[2:, 2:]
    frozen.flags.writeable = False
    assert _images.image(frozen, "bgr").array is frozen


def test_errors_have_kinds_statuses_and_words():
    scene = made.scene()
    with pytest.raises(ValueError, match="view") as caught:
        scene.set_depth_range(77, (1.0, 2.0))
    assert isinstance(caught.value, skep.Error) and caught.value.status == -2 and "77" in str(caught.value)
    with pytest.raises(OSError, match="nowhere") as missing:
        skep.Scene.read("/nowhere")
    assert isinstance(missing.value, skep.FileError) and missing.value.status == -5
    for wrong in (-1, 1 << 32):
        with pytest.raises(skep.ArgumentError, match="view is"):
            scene.depth_range(wrong)
    with pytest.raises(skep.ArgumentError, match="sources"):
        scene.set_sources(0, [-1])
    scene.set_sources(0, [0])
    with pytest.raises(skep.ArgumentError, match="sources"):
        scene.validate()
    with pytest.raises(skep.ArgumentError, match="one for each of the 1 points"):
        scene.add_points([[0, 0, 0]], [])
    with pytest.raises(skep.ArgumentError, match=r"must be \(n, 3\)"):
        scene.add_points([0, 0, 0], [[0]])
    with pytest.raises(skep.ArgumentError):
        skep.reconstruct(skep.Scene())


def test_cameras_are_checked():
    for K in (np.eye(4), [[10, 1, 4], [0, 10, 3], [0, 0, 1]], [[10, 0, 4], [0, 10, 3], [0, 0, 2]]):
        with pytest.raises(skep.ArgumentError, match="K "):
            skep.Camera(K)
    for R, words in ((np.diag([1, 1, -1]), "rotation"), (2 * np.eye(3), "rotation")):
        with pytest.raises(skep.ArgumentError, match=words):
            skep.Scene().add_view(GRAY, skep.Camera(CAMERA.K, R))
    assert skep.Camera(CAMERA.K, t=[[1], [2], [3]]).t.tolist() == [1, 2, 3]
    assert not CAMERA.K.flags.writeable and "K=[[10.0" in repr(CAMERA)


def test_options_are_items_and_attributes():
    options = skep.Options(max_sources=6, fusion_min_agreeing_views=2, seed=5)
    assert (
        options["view_selection.max_sources"]
        == options.view_selection_max_sources
        == options["max_sources"]
        == 6
    )
    assert options["fusion.min_agreeing_views"] == options.fusion_min_agreeing_views == options.min_agreeing_views == 2
    options["fusion.min_agreeing_views"] = 4
    options.view_propagation = False
    options.check_depth_tolerance = 0.1 + 0.2
    assert options.fusion_min_agreeing_views == 4 and options["search.view_propagation"] is False
    assert options["check.depth_tolerance"] == 0.1 + 0.2 and options.fusion_depth_tolerance == 0.01
    assert options == skep.Options(**dict(options)) and len(options) == len(dict(options)) > 20
    assert "fusion.min_agreeing_views" in options and "best_views" in options and "best_views" in dir(options)
    assert "seed" in repr(options)


def test_values_of_options_have_types():
    options = skep.Options("paper", seed=(1 << 64) - 1)
    assert options.seed == (1 << 64) - 1 and type(options.threads) is int
    assert type(options.window_sigma_spatial) is float and options.window_sigma_spatial == 5
    assert options.refine_fill_gaps is False and options.simd == "best"
    assert options.schedule_scales == options["scales"] == "downscale=1 food_sources=10 iterations=20+3x2"
    options.scales = (
        "downscale=2 food_sources=4 iterations=2+2x1; downscale=1 food_sources=3 iterations=1+1x1"
    )
    assert options.schedule_scales.startswith("downscale=2 food_sources=4 iterations=2+2x1; ")
    options.min_consistent_views, options.fill_gaps = np.uint8(3), np.bool_(True)
    assert options.check_min_consistent_views == 3 and options.refine_fill_gaps is True


def test_options_refuse_what_is_none():
    options = skep.Options()
    before = dict(options)
    with pytest.raises(KeyError):
        options["nonsense"]
    with pytest.raises(AttributeError):
        options.nonsense
    with pytest.raises(AttributeError):
        options.nonsense = 1
    for refused in (
        lambda: options.__setitem__("nonsense", 1),
        lambda: options.__setitem__("max_sources", 1.5),
        lambda: setattr(options, "min_consistent_fraction", 2),
        lambda: setattr(options, "scales", "downscale=2 food_sources=4 iterations=2+2x1"),
        lambda: setattr(options, "seed", -1),
        lambda: setattr(options, "simd", "v9"),
        lambda: options.__setitem__("depth_tolerance", 0.1),
        lambda: options.__setitem__("fill_gaps", "yes"),
        lambda: skep.Options("best"),
        lambda: skep.Options(nonsense=1),
    ):
        with pytest.raises(skep.ArgumentError):
            refused()
    assert dict(options) == before
