"""Clouds and maps of the command line, read by other packages."""

import subprocess
from pathlib import Path

import made
import numpy as np
import pytest
import skep

OPTIONS = ["--quiet", "--schedule", made.TWO_SCALES, "--set", "fusion.min_agreeing_views=2"]


def succeed(*command) -> None:
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"


@pytest.fixture(scope="module")
def dense(program, tmp_path_factory) -> Path:
    scene = made.scene_folder(tmp_path_factory.mktemp("scene"))
    folder = tmp_path_factory.mktemp("dense")
    succeed(program, "reconstruct", scene, "--output", folder, *OPTIONS)
    return folder


def first_name(dense: Path) -> str:
    return (dense / "stereo/fusion.cfg").read_text().splitlines()[0]


@pytest.mark.parametrize("ending", ["pfm", "npy", "tiff"])
def test_maps(program, dense, need, tmp_path, ending):
    reader = {"pfm": "imageio.v3", "npy": "numpy", "tiff": "tifffile"}[ending]
    package = need(reader)
    read = {"pfm": "imread", "npy": "load", "tiff": "imread"}[ending]
    succeed(program, "convert", dense, "--to", ending, "-o", tmp_path)
    name = first_name(dense)
    for what, map_reader in [
        ("depth_maps", skep.read_depth_map),
        ("confidence_maps", skep.read_depth_map),
        ("normal_maps", skep.read_normal_map),
    ]:
        found = np.asarray(getattr(package, read)(tmp_path / what / f"{name}.{ending}"))
        expected = map_reader(dense / "stereo" / what / f"{name}.geometric.bin")
        assert found.dtype == np.float32
        # imageio leaves the rows of PFM in the order of the file, from the bottom to the top.
        np.testing.assert_array_equal(found[::-1] if ending == "pfm" else found, expected)


def test_ply(program, dense, need, tmp_path):
    plyfile = need("plyfile")
    succeed(program, "fuse", dense, "-o", tmp_path / "a.ply", "--max-points", "100", "--splat", *OPTIONS[3:])
    start = tmp_path / "splat/sparse/0/points3D.ply"
    for file in [tmp_path / "a.ply", start]:
        vertex = plyfile.PlyData.read(str(file))["vertex"]
        assert vertex.count == 100
        assert [p.name for p in vertex.properties] == "x y z nx ny nz red green blue".split()
        assert vertex["x"].dtype == np.float32


@pytest.mark.parametrize("ending", ["las", "laz"])
def test_las(program, dense, need, tmp_path, ending):
    need("lazrs")
    laspy, plyfile = need("laspy"), need("plyfile")
    succeed(program, "fuse", dense, "-o", tmp_path / f"a.{ending}", *OPTIONS[3:])
    succeed(program, "fuse", dense, "-o", tmp_path / "a.ply", *OPTIONS[3:])
    found, expected = laspy.read(tmp_path / f"a.{ending}"), plyfile.PlyData.read(str(tmp_path / "a.ply"))["vertex"]
    assert len(found.points) == expected.count > 500
    for axis in "xyz":
        np.testing.assert_allclose(np.asarray(found[axis]), expected[axis], atol=1e-3)
        np.testing.assert_array_equal(np.asarray(found[f"Normal{axis.upper()}"]), expected[f"n{axis}"])
    for color in ("red", "green", "blue"):
        np.testing.assert_array_equal(np.asarray(found[color]) // 257, expected[color])


def test_positions_far_from_the_origin(need, tmp_path):
    """A cloud moved to where floats are a quarter of a meter apart keeps its places."""
    plyfile = need("plyfile")
    offset = np.array([4_123_456.7, -912_345.6, 4_765_432.1])
    views = []
    for photograph in made.photographs():
        camera = photograph.camera
        moved = skep.Camera(camera.K, camera.R, camera.t - camera.R @ offset)
        depth, normal = photograph.depth.astype(np.float32), photograph.normal.astype(np.float32)
        views.append(skep.FusionView(moved, depth, normal, photograph.image))
    cloud = skep.fuse(views)
    cloud.write_ply(tmp_path / "moved.ply")
    vertex = plyfile.PlyData.read(str(tmp_path / "moved.ply"))["vertex"]
    found = np.stack([vertex[axis] for axis in "xyz"], axis=-1)
    assert found.dtype == np.float64
    np.testing.assert_array_equal(found, cloud.positions)
    assert len(np.unique(found, axis=0)) > 0.98 * vertex.count > 500
