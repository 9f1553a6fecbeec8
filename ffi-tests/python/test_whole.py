"""Whole runs: results and their lifetimes."""

import gc

import made
import numpy as np
import pytest
import skep
from skep import PixelStatus


def test_validated_depths_and_normals_are_those_of_the_world(result):
    for view, truth in zip(result, made.photographs()):
        given = view.validated_depth > 0
        assert given.mean() > 0.6
        error = np.abs(view.validated_depth[given] / truth.depth[given] - 1)
        assert np.median(error) < 2e-3
        assert np.mean(error < 0.01) > 0.93
        angle = np.degrees(np.arccos(np.clip((view.validated_normal * truth.normal).sum(-1)[given], -1, 1)))
        assert np.median(angle) < 6
        np.testing.assert_allclose(np.linalg.norm(view.normal[view.depth > 0], axis=-1), 1, atol=1e-5)


def test_maps_fit_each_other(result):
    assert len(result) == len(made.PLACES) and [view.view for view in result] == list(range(len(result)))
    for view in result:
        validated = view.status == PixelStatus.VALIDATED
        assert view.size == (made.WIDTH, made.HEIGHT)
        assert view.depth.shape == view.cost.shape == view.status.shape == (made.HEIGHT, made.WIDTH)
        assert view.depth.dtype == view.normal.dtype == view.cost.dtype == np.float32
        assert np.array_equal(view.validated_depth, np.where(validated, view.depth, 0))
        assert np.array_equal(view.validated_normal, np.where(validated[..., None], view.normal, 0))
        assert view.cost.min() >= 0 and view.cost.max() <= 2
        for status in PixelStatus:
            assert view.statistics.status_counts[status] == (view.status == status).sum()
        assert sum(view.statistics.status_counts.values()) == view.depth.size
        assert view.statistics.ncc_evaluations > view.depth.size
        assert view.cycles[0].downscale == 2 and view.cycles[-1].downscale == 1
        assert view.cycles[-1].pixels == view.depth.size


def test_source_counts_are_those_of_the_source_sets(result, scene):
    for view in result:
        assert view.sources == scene.sources(view.view, made.options())
        matched = np.sum([view.visible_in(source) for source in view.sources], axis=0)
        assert np.array_equal(matched, view.source_count)
    with pytest.raises(skep.ArgumentError, match="source is 99"):
        result[0].visible_in(99)


def test_raw_maps_are_the_memory_of_the_result(result):
    view = result[1]
    for name in ("depth", "normal", "cost", "status"):
        array = getattr(view, name)
        again = getattr(skep.ResultView(result._handle, 1), name)
        assert not array.flags.owndata and not array.flags.writeable and array.flags.c_contiguous
        assert array.ctypes.data == again.ctypes.data and np.shares_memory(array, again)
        with pytest.raises(ValueError):
            array[0, 0] = 0
    assert view.validated_depth.flags.owndata and not np.shares_memory(view.validated_depth, view.depth)


def test_an_array_outlives_the_result():
    found = skep.reconstruct(made.scene(), quick())
    depth, expected = found[0].depth, found[0].depth.copy()
    row = depth[10]
    del found, depth
    gc.collect()
    # Memory that would be reused if it had been freed.
    others = [np.full(expected.shape, 7, dtype=np.float32) for _ in range(100)]
    assert np.array_equal(row, expected[10]) and len(others) == 100


def quick() -> skep.Options:
    return skep.Options(
        threads=2,
        schedule_scales=made.TWO_SCALES,
    )


def test_bits_do_not_depend_on_threads_instruction_set_or_array_layout():
    def depths(change, **values):
        scene = skep.Scene()
        for photograph in made.photographs()[:3]:
            image, order = change(photograph.image)
            scene.add_view(image, photograph.camera, order=order, depth_range=made.DEPTH_RANGE)
        options = skep.Options(schedule_scales=quick().schedule_scales, **values)
        if values["threads"] == 1:
            options.simd = "scalar"
        return [view.depth.tobytes() for view in skep.reconstruct(scene, options)]

    def wide(image):
        padded = np.full((made.HEIGHT + 4, made.WIDTH + 9, 3), 77, dtype=np.uint8)
        padded[2:-2, 5:-4] = image
        return padded[2:-2, 5:-4], "rgb"

    expected = depths(lambda image: (image, "rgb"), threads=2)
    assert depths(lambda image: (image, "rgb"), threads=1) == expected
    assert depths(wide, threads=2) == expected
    assert depths(lambda image: (image[:, :, ::-1], "bgr"), threads=2) == expected
    assert depths(lambda image: (image[::-1].copy()[::-1], "rgb"), threads=2) == expected
    assert depths(lambda image: (np.dstack([image, image[:, :, 0]]), "rgb"), threads=2) == expected
    assert depths(lambda image: (image.astype(np.uint16) * 257, "rgb"), threads=2) == expected
    assert depths(lambda image: ((image / 255).astype(np.float32), "rgb"), threads=2) == expected


def test_the_cloud_lies_on_the_surfaces(result):
    cloud = result.cloud
    assert len(cloud) > 3000
    assert cloud.positions.shape == cloud.normals.shape == cloud.colors.shape == (len(cloud), 3)
    assert (cloud.positions.dtype, cloud.normals.dtype, cloud.colors.dtype) == (
        np.float64,
        np.float32,
        np.uint8,
    )
    wall = np.abs(cloud.positions @ made.WALL + made.WALL_DISTANCE)
    ball = np.abs(np.linalg.norm(cloud.positions - made.BALL, axis=1) - made.RADIUS)
    assert np.median(np.minimum(wall, ball)) < 0.01
    assert cloud.view_counts.sum() == cloud.views.size and cloud.view_counts.min() >= 3
    assert cloud.views.max() < len(result)
    colors = made.texture(cloud.positions) * 255
    assert np.median(np.abs(colors - cloud.colors)) < 25


def test_fusion_of_a_runs_validated_maps_gives_its_cloud(result, scene):
    views = [
        skep.FusionView(
            photograph.camera,
            view.validated_depth,
            view.validated_normal,
            photograph.image,
            scene.overlap(view.view),
            confidence=view.confidence,
        )
        for photograph, view in zip(made.photographs(), result)
    ]
    cloud = skep.fuse(views, made.options())
    assert np.array_equal(cloud.positions, result.cloud.positions)
    assert np.array_equal(cloud.normals, result.cloud.normals)
    assert np.array_equal(cloud.colors, result.cloud.colors)
    assert np.array_equal(cloud.views, result.cloud.views)
    gray = skep.fuse(
        [skep.FusionView(view.camera, view.depth, view.normal) for view in views], made.options()
    )
    assert len(gray) == len(cloud) and (gray.colors == 128).all()


def test_fusion_names_what_is_wrong(result):
    camera, depth, normal = made.photographs()[0].camera, result[0].depth, result[0].normal
    for view, words in [
        (skep.FusionView(camera, depth, depth), r"views\[0\].normal has shape"),
        (skep.FusionView(camera, depth.astype(complex), normal), r"views\[0\].depth has type"),
        (skep.FusionView(camera, depth, normal, overlap=[5]), r"views\[0\].overlap"),
    ]:
        with pytest.raises(skep.ArgumentError, match=words):
            skep.fuse([view, skep.FusionView(camera, depth, normal)])


def test_a_run_warns_of_views_without_enough_sources():
    scene = skep.Scene()
    for photograph in made.photographs()[:2]:
        scene.add_view(photograph.image, photograph.camera, depth_range=made.DEPTH_RANGE)
    options = quick()
    options.check_few_views = 0
    found = skep.reconstruct(scene, options)
    assert len(found.warnings) > 0 and all("source" in warning for warning in found.warnings)
    assert len(found.cloud) == 0 and found.cloud.positions.shape == (0, 3) and found.cloud.views.shape == (0,)
    assert (found[0].status == PixelStatus.NO_SOURCES).any()
