"""Copying and pickling, equality, and what objects look like in a prompt."""

import copy
import pickle
import sys

import made
import numpy as np
import pytest
import skep


def sent(value):
    """As another process gets it."""
    return pickle.loads(pickle.dumps(value))


def test_options_are_copied_and_sent_by_their_values():
    options = skep.Options("fast", seed=5, check_depth_tolerance=0.1 + 0.2, simd="scalar")
    for copied in (sent(options), copy.copy(options), copy.deepcopy(options)):
        assert copied == options and type(copied) is skep.Options
        copied.seed = 6
        assert options.seed == 5
    namespace = {"Options": skep.Options}
    assert eval(repr(options), namespace) == options
    assert repr(skep.Options(threads=2)) == "Options(threads=2)" and repr(skep.Options()) == "Options()"


def test_cameras_are_equal_by_their_numbers_and_never_change():
    camera = made.photographs()[0].camera
    for same in (sent(camera), copy.copy(camera), skep.Camera(camera.K, camera.R, camera.t)):
        assert same == camera and hash(same) == hash(camera) and not same.K.flags.writeable
    others = {photograph.camera for photograph in made.photographs()}
    assert len(others) == len(made.PLACES) and camera in others
    assert camera != skep.Camera(camera.K) and camera != camera.K.tolist()
    assert skep.Camera(camera.K, t=[0.0, 0, 0]) == skep.Camera(camera.K, t=[-0.0, 0, 0])
    with pytest.raises(AttributeError, match="make another camera"):
        camera.K = np.eye(3)


def test_a_copied_scene_changes_by_itself():
    scene = made.scene()
    for copied in (copy.copy(scene), copy.deepcopy(scene)):
        copied.set_depth_range(0, (1.0, 50.0))
        copied.add_view(made.photographs()[0].image, made.photographs()[0].camera, depth_range=(1, 2))
        assert (len(copied), copied.depth_range(0)) == (len(scene) + 1, (1.0, 50.0))
        assert scene.depth_range(0) == made.DEPTH_RANGE
    quick = skep.Options(schedule_scales=made.TWO_SCALES, threads=2)
    first, second = (skep.reconstruct(each, quick) for each in (scene, copy.copy(scene)))
    assert np.array_equal(first[0].depth, second[0].depth)


def test_results_are_sent_as_their_arrays(result, scene, tmp_path):
    for other in (sent(result), copy.deepcopy(result)):
        assert len(other) == len(result) and other.warnings == result.warnings
        for ours, theirs in zip(result, other):
            assert (ours.view, ours.size, ours.sources) == (theirs.view, theirs.size, theirs.sources)
            assert (ours.statistics, ours.cycles) == (theirs.statistics, theirs.cycles)
            for name in ("depth", "normal", "cost", "confidence", "status", "source_count"):
                assert np.array_equal(getattr(ours, name), getattr(theirs, name)), name
                assert not np.shares_memory(getattr(ours, name), getattr(theirs, name))
            assert np.array_equal(ours.validated_depth, theirs.validated_depth)
            assert np.array_equal(ours.validated_normal, theirs.validated_normal)
            assert all(np.array_equal(ours.visible_in(n), theirs.visible_in(n)) for n in ours.sources)
        for name in ("positions", "normals", "colors", "view_counts", "views"):
            assert np.array_equal(getattr(result.cloud, name), getattr(other.cloud, name)), name
        assert len(other.cloud) == len(result.cloud)
    assert copy.copy(result) is result and copy.copy(result.cloud) is result.cloud
    copy.deepcopy(result).write_workspace(scene, tmp_path)
    received = sent(result)
    with pytest.raises(skep.ArgumentError, match="unpickled cannot be written: do it where it was made"):
        received.write_workspace(scene, tmp_path)
    with pytest.raises(skep.ArgumentError, match="unpickled"):
        received.cloud.write_ply(tmp_path / "cloud.ply")
    view = sent(result[1])
    assert view.view == 1 and np.array_equal(view.validated_depth, result[1].validated_depth)


def test_what_cannot_be_sent_says_what_to_send_instead(scene, tmp_path):
    stepper = skep.Stepper(scene, made.options(schedule_scales=made.TWO_SCALES))
    estimate = stepper.search(0, 0)
    image = skep.PackedImage(made.photographs()[0].image)
    for value, words in [
        (scene, r"skep.Scene cannot be pickled: send the arguments of add_view, or a folder"),
        (stepper, "its scene and options"),
        (estimate, r"estimate.save\(\)"),
        (image, "the image"),
        (skep.NccWindow(), "its arguments"),
    ]:
        with pytest.raises(TypeError, match=words):
            pickle.dumps(value)
        assert value is scene or copy.copy(value) is copy.deepcopy(value) is value
    with skep.Job.plan(made.scene_folder(tmp_path / "scene"), tmp_path / "run", made.options()) as job:
        with pytest.raises(TypeError, match="Job.open"):
            pickle.dumps(job)
        assert repr(job).startswith("<skep.Job of 6 views, ")
    assert repr(job) == "<skep.Job, closed>"
    width, height = estimate.size
    assert repr(estimate) == f"<skep.Estimate of view 0, searched in cycle 0, {width} x {height}>"
    assert repr(stepper) == "<skep.Stepper of 6 views, 4 cycles at most>"


def test_arrays_are_taken_by_other_libraries_without_a_copy(result):
    for array in (result[0].validated_depth, result.cloud.positions):
        assert np.shares_memory(np.from_dlpack(array), array)
    view = memoryview(result[0].depth)
    assert view.readonly and view.shape == result[0].depth.shape


def test_the_cloud_is_given_to_open3d(result, monkeypatch):
    """With a module in its place, as the real one is large."""

    class Points:
        def __init__(self, points):
            self.points = points

    class Open3d:
        class utility:
            Vector3dVector = staticmethod(np.array)

        class geometry:
            PointCloud = Points

    monkeypatch.setitem(sys.modules, "open3d", Open3d)
    points = result.to_open3d()
    assert np.array_equal(points.points, result.cloud.positions)
    assert points.normals.dtype == np.float64 and np.array_equal(points.normals, result.cloud.normals)
    assert np.array_equal(np.round(points.colors * 255), result.cloud.colors) and points.colors.max() <= 1
    monkeypatch.setitem(sys.modules, "open3d", None)
    with pytest.raises(ImportError, match="pip install open3d"):
        result.cloud.to_open3d()
