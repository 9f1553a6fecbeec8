"""Folders and files in COLMAP's layouts."""

import made
import numpy as np
import pytest
import skep


def test_maps_come_back_as_they_were_written(tmp_path):
    depth = np.random.default_rng(2).random((7, 20), dtype=np.float32)[:, 4:15]
    normal = np.random.default_rng(3).random((7, 11, 3)).astype(np.float32)
    skep.write_depth_map(tmp_path / "d.bin", depth)
    skep.write_normal_map(tmp_path / "n.bin", normal)
    assert np.array_equal(skep.read_depth_map(tmp_path / "d.bin"), depth)
    assert np.array_equal(skep.read_normal_map(str(tmp_path / "n.bin")), normal)
    counts = np.zeros((7, 11), dtype=int)
    counts[2, 3], counts[6, 10] = 2, 1
    skep.write_consistency_graph(tmp_path / "c.bin", counts, [4, 1, 3])
    read, views = skep.read_consistency_graph(tmp_path / "c.bin")
    assert np.array_equal(read, counts) and views.tolist() == [4, 1, 3]
    # COLMAP's layout: a header in text, then floats channel by channel.
    raw = (tmp_path / "n.bin").read_bytes()
    assert raw.startswith(b"11&7&3&")
    assert np.array_equal(np.frombuffer(raw[7:], dtype="<f4").reshape(3, 7, 11), normal.transpose(2, 0, 1))


def test_files_that_cannot_be_are_refused(tmp_path):
    (tmp_path / "d.bin").write_bytes(b"4&4&1&short")
    with pytest.raises(skep.FileError, match="d.bin"):
        skep.read_depth_map(tmp_path / "d.bin")
    with pytest.raises(skep.ArgumentError, match="depth has shape"):
        skep.write_depth_map(tmp_path / "x.bin", np.zeros(4))
    with pytest.raises(skep.ArgumentError, match="normal has shape"):
        skep.write_normal_map(tmp_path / "x.bin", np.zeros((4, 4)))
    with pytest.raises(skep.ArgumentError, match="file"):
        skep.read_depth_map("a\0b")
    assert not (tmp_path / "x.bin").exists()


def test_a_scene_folder_comes_back_as_it_was_written(tmp_path):
    scene = made.scene()
    scene.add_points(*made.points())
    scene.write_colmap(tmp_path)
    read = skep.Scene.read(tmp_path)
    assert len(read) == len(scene)
    for view in range(len(read)):
        assert read.name(view) == scene.name(view) and read.size(view) == scene.size(view)
        np.testing.assert_allclose(read.camera(view).K, scene.camera(view).K, atol=1e-9)
        np.testing.assert_allclose(read.camera(view).t, scene.camera(view).t, atol=1e-9)
    assert skep.Scene.read(tmp_path, (1.0, 8.0)).depth_range(3) == (1.0, 8.0)
    seen = []
    skep.Scene.read(tmp_path, progress=seen.append)
    assert seen[-1].done == 1.0 and {progress.phase for progress in seen} == {skep.Phase.READ}
    with pytest.raises(skep.Cancelled):
        skep.Scene.read(tmp_path, progress=lambda progress: skep.CANCEL)


def test_a_workspace_holds_the_maps_and_the_cloud(tmp_path, result, scene):
    result.write_workspace(scene, tmp_path)
    result.cloud.write_ply(tmp_path / "cloud.ply")
    for view in result:
        for kind, depth, normal in (
            ("photometric", view.depth, view.normal),
            ("geometric", view.validated_depth, view.validated_normal),
        ):
            name = f"{scene.name(view.view)}.{kind}.bin"
            assert np.array_equal(skep.read_depth_map(tmp_path / "stereo/depth_maps" / name), depth)
            assert np.array_equal(skep.read_normal_map(tmp_path / "stereo/normal_maps" / name), normal)
    ply = (tmp_path / "cloud.ply").read_bytes()
    assert (
        f"element vertex {len(result.cloud)}".encode() in ply and ply == (tmp_path / "fused.ply").read_bytes()
    )
    assert (tmp_path / "cloud.ply.vis").exists()
