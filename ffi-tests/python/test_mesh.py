"""Meshes of runs, and arrays that other libraries take without a copy."""

import os
import subprocess
import sys

import made
import numpy as np
import pytest
import skep
from skep import _mesh


@pytest.fixture(scope="module")
def run_folder(scene, result, tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    scene.write_colmap(folder)
    result.write_workspace(scene, folder)
    return folder


def command(*arguments):
    line = [sys.executable, "-m", "skep", "mesh", *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True)


def test_the_views_of_a_run_come_with_their_maps_and_photographs(run_folder, result, scene):
    views = list(_mesh.mapped_views(run_folder))
    assert [view.name for view in views] == [scene.name(number) for number in range(len(scene))]
    for view, expected, photograph in zip(views, result, made.photographs()):
        assert np.array_equal(view.depth, expected.validated_depth)
        assert np.allclose(view.camera.R, photograph.camera.R) and view.photograph.is_file()
    depths = np.concatenate([view.depth[view.depth > 0] for view in views])
    assert _mesh.voxel_size(run_folder) == pytest.approx(2 * np.median(depths) / made.FOCAL, rel=0.05)


def test_the_scene_may_be_above_the_run(run_folder, tmp_path):
    (tmp_path / "scene").symlink_to(run_folder)
    run = tmp_path / "other" / "run"
    run.mkdir(parents=True)
    (run / "stereo").symlink_to(run_folder / "stereo")
    for part in ("images", "sparse"):
        (run.parent / part).symlink_to(run_folder / part)
    assert len(list(_mesh.mapped_views(run))) == len(made.PLACES)


def test_wrong_arguments_are_named(run_folder, tmp_path):
    for call, words in (
        (lambda: _mesh.poisson(run_folder / "fused.ply", depth=40), "depth is 40: must be 4 to 14"),
        (lambda: _mesh.poisson(run_folder / "fused.ply", trim=1.5), "trim is 1.5"),
        (lambda: _mesh.tsdf(run_folder, voxel=float("nan")), "voxel is nan"),
        (lambda: list(_mesh.mapped_views(tmp_path)), "expected the depth maps of a run"),
        (lambda: _mesh.main([str(run_folder), "-o", "mesh.jpg"]), "--output is mesh.jpg"),
    ):
        with pytest.raises(skep.Error, match=words):
            call()
    refused = command(run_folder, "--method", "guess")
    assert refused.returncode == 2 and "poisson" in refused.stderr


def test_a_map_of_another_size_is_named(run_folder, tmp_path):
    (tmp_path / "images").symlink_to(run_folder / "images")
    (tmp_path / "sparse").symlink_to(run_folder / "sparse")
    name = next(_mesh.mapped_views(run_folder)).name
    file = tmp_path / "stereo" / "depth_maps" / f"{name}.geometric.bin"
    skep.write_depth_map(file, np.ones((3, 4), dtype=np.float32))
    with pytest.raises(skep.FileError, match="the map is 4x3; expected 96x72"):
        list(_mesh.mapped_views(tmp_path))
    skep.write_depth_map(file, np.zeros((72, 96), dtype=np.float32))
    with pytest.raises(skep.FileError, match="no validated depth"):
        list(_mesh.mapped_views(tmp_path))


def test_without_open3d_the_error_says_how_to_get_it(run_folder, monkeypatch, capsys):
    from skep.__main__ import main

    monkeypatch.setitem(sys.modules, "open3d", None)
    assert main(["mesh", str(run_folder)]) == 1
    assert "pip install open3d" in capsys.readouterr().err


@pytest.mark.parametrize("method", ["poisson", "tsdf"])
def test_a_mesh_lies_on_the_true_surface(run_folder, tmp_path, method):
    open3d = pytest.importorskip("open3d", reason="open3d is large; ffi-tests/long installs it")
    output = tmp_path / "mesh.ply"
    made_now = command(run_folder, "-o", output, "--method", method, "--depth", 6)
    assert made_now.returncode == 0, made_now.stderr
    assert made_now.stdout.endswith(f"triangles in {output}\n")
    mesh = open3d.io.read_triangle_mesh(str(output))
    vertices, colors = np.asarray(mesh.vertices), np.asarray(mesh.vertex_colors)
    assert len(vertices) > 500 and colors.shape == vertices.shape and colors.std() > 0.05
    to_wall = np.abs(vertices @ made.WALL + made.WALL_DISTANCE)
    to_ball = np.abs(np.linalg.norm(vertices - made.BALL, axis=1) - made.RADIUS)
    assert np.median(np.minimum(to_wall, to_ball)) < 0.03


def test_a_cloud_without_normals_is_refused(tmp_path):
    pytest.importorskip("open3d", reason="open3d is large; ffi-tests/long installs it")
    cloud = tmp_path / "cloud.ply"
    header = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
    cloud.write_text(header + "end_header\n0 0 0\n")
    refused = command(tmp_path, "--cloud", cloud)
    assert refused.returncode == 1 and "points with normals" in refused.stderr
    assert command(tmp_path).returncode == 1 and not os.path.exists(tmp_path / "mesh.ply")


def test_arrays_are_exchanged_without_a_copy(result):
    view, cloud = result[0], result.cloud
    arrays = [view.validated_depth, view.validated_normal, view.source_count]
    arrays += [cloud.positions, cloud.normals, cloud.colors]
    for array in arrays:
        taken = np.from_dlpack(array)
        assert np.shares_memory(taken, array) and np.array_equal(taken, array)
        assert array.__array_interface__["data"][0] == taken.__array_interface__["data"][0]
    # Raw maps are read-only, which DLPack knows from its version 1 on, and numpy from 2.1 on.
    raw = [view.depth, view.normal, view.cost, view.confidence, view.status]
    for array in raw:
        assert np.shares_memory(np.asarray(array), array)
        if np.lib.NumpyVersion(np.__version__) >= "2.1.0":
            taken = np.from_dlpack(array)
            assert np.shares_memory(taken, array) and not taken.flags.writeable
