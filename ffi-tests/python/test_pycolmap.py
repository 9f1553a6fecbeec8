"""skep and pycolmap: reconstructions are read and workspaces written without a shift of half a pixel."""

import os
import shutil

import made
import numpy as np
import pytest
import skep

BOARD = os.path.join(os.path.dirname(__file__), "../../examples/data/board")


@pytest.fixture(scope="module")
def pycolmap(need):
    return need("pycolmap")


@pytest.fixture(scope="module")
def folder(pycolmap, tmp_path_factory):
    """The made scene as COLMAP would have it: photographs, and a model that pycolmap itself wrote."""
    folder = tmp_path_factory.mktemp("colmap")
    for name in ("images", "sparse"):
        (folder / name).mkdir()
    reconstruction = pycolmap.Reconstruction()
    found = made.photographs()
    positions, views = made.points()
    fx, fy, (cx, cy) = found[0].camera.K[0, 0], found[0].camera.K[1, 1], found[0].camera.K[:2, 2]
    # COLMAP has the center of the top-left pixel at (0.5, 0.5).
    parameters = [fx, fy, cx + 0.5, cy + 0.5]
    reconstruction.add_camera_with_trivial_rig(
        pycolmap.Camera(camera_id=1, model="PINHOLE", width=made.WIDTH, height=made.HEIGHT, params=parameters)
    )
    tracks = [[] for _ in positions]
    for view, photograph in enumerate(found):
        camera = photograph.camera
        bitmap = pycolmap.Bitmap.from_array(photograph.image)
        bitmap.write(str(folder / "images" / f"{view}.png"))
        points = []
        for track, position, seen in zip(tracks, positions, views):
            if view in seen:
                x, y, depth = camera.K @ (camera.R @ position + camera.t)
                track.append(pycolmap.TrackElement(view + 1, len(points)))
                points.append(pycolmap.Point2D([x / depth + 0.5, y / depth + 0.5]))
        image = pycolmap.Image(f"{view}.png", pycolmap.Point2DList(points), camera_id=1, image_id=view + 1)
        pose = pycolmap.Rigid3d(np.hstack([camera.R, camera.t[:, None]]))
        reconstruction.add_image_with_trivial_frame(image, pose)
    for track, position in zip(tracks, positions):
        reconstruction.add_point3D(position, pycolmap.Track(track))
    reconstruction.write(str(folder / "sparse"))
    return folder


@pytest.fixture(scope="module")
def reconstruction(pycolmap, folder):
    return pycolmap.Reconstruction(str(folder / "sparse"))


def test_a_reconstruction_becomes_a_scene(reconstruction, folder):
    scene = skep.from_pycolmap(reconstruction, folder / "images")
    read = skep.Scene.read(folder)
    assert len(scene) == len(read) == len(made.PLACES)
    for view, photograph in enumerate(made.photographs()):
        assert scene.name(view) == read.name(view) == f"{view}.png"
        for one in (scene, read):
            np.testing.assert_allclose(one.camera(view).K, photograph.camera.K, atol=1e-9)
            np.testing.assert_allclose(one.camera(view).R, photograph.camera.R, atol=1e-9)
            np.testing.assert_allclose(one.camera(view).t, photograph.camera.t, atol=1e-9)
        assert scene.depth_range(view) == read.depth_range(view)
        assert scene.sources(view) == read.sources(view) != ()


def test_half_a_pixel_is_where_pycolmap_has_it(reconstruction):
    """What pycolmap projects lies half a pixel from what a skep camera projects."""
    for image in reconstruction.images.values():
        camera = made.photographs()[image.image_id - 1].camera
        for point in reconstruction.points3D.values():
            x, y, depth = camera.K @ (camera.R @ point.xyz + camera.t)
            np.testing.assert_allclose(
                image.project_point(point.xyz), [x / depth + 0.5, y / depth + 0.5], atol=1e-6
            )


def test_pycolmap_fuses_our_workspace(pycolmap, reconstruction, folder, tmp_path):
    """Its fusion of our validated maps finds about as many points as ours, on the same surfaces."""
    scene = skep.from_pycolmap(reconstruction, folder / "images")
    result = skep.reconstruct(scene, made.options())
    workspace = tmp_path / "dense"
    scene.write_colmap(workspace)
    result.write_workspace(scene, workspace)
    (tmp_path / "fused").mkdir()
    # Our tolerances. Within 2 pixels, its default, it would merge neighboring pixels of such small images.
    options = pycolmap.StereoFusionOptions(
        min_num_pixels=3, max_reproj_error=0.5, max_depth_error=0.01, max_normal_error=30, num_threads=2
    )
    fused = pycolmap.stereo_fusion(tmp_path / "fused", workspace, input_type="geometric", options=options)
    positions = np.array([point.xyz for point in fused.points3D.values()])
    ours = result.cloud.positions
    print(f"{len(positions)} points of pycolmap's, {len(ours)} of ours")
    assert 0.6 < len(positions) / len(ours) < 1.5
    wall = np.abs(positions @ made.WALL + made.WALL_DISTANCE)
    ball = np.abs(np.linalg.norm(positions - made.BALL, axis=1) - made.RADIUS)
    assert np.median(np.minimum(wall, ball)) < 0.01


def test_the_board_is_read_as_pycolmap_reads_it(pycolmap):
    board = pycolmap.Reconstruction(os.path.join(BOARD, "sparse"))
    scene = skep.from_pycolmap(board, os.path.join(BOARD, "images"))
    read = skep.Scene.read(BOARD)
    by_name = {read.name(view): view for view in range(len(read))}
    assert len(scene) == len(read) == len(by_name)
    for view in range(len(scene)):
        same = by_name[scene.name(view)]
        np.testing.assert_allclose(scene.camera(view).K, read.camera(same).K)
        np.testing.assert_allclose(scene.depth_range(view), read.depth_range(same))


def test_distorted_cameras_and_missing_images_are_refused(pycolmap, reconstruction, folder, tmp_path):
    with pytest.raises(skep.FileError, match="0.png"):
        skep.from_pycolmap(reconstruction, tmp_path)
    distorted = pycolmap.Reconstruction(str(folder / "sparse"))
    distorted.cameras[1].model = pycolmap.CameraModelId.SIMPLE_RADIAL
    distorted.cameras[1].params = [100, 48, 36, 0.1]
    with pytest.raises(skep.ArgumentError, match="camera 1 is SIMPLE_RADIAL.*undistort"):
        skep.from_pycolmap(distorted, folder / "images")


@pytest.mark.parametrize(
    ("model", "distortion"),
    [
        ("RADIAL", [-0.06, 0.01]),
        ("OPENCV", [-0.06, 0.01, 0.001, -0.0005]),
        ("FULL_OPENCV", [-0.06, 0.01, 0.001, -0.0005, 0.002, 0.01, 0.002, 0.001]),
        ("OPENCV_FISHEYE", [0.01, -0.005, 0.001, 0.0]),
        ("THIN_PRISM_FISHEYE", [0.01, -0.005, 0.001, 0.0, 0.001, 0.0005, 0.001, 0.0005]),
        ("FOV", [0.5]),
    ],
)
def test_photographs_are_undistorted_as_colmap_does(pycolmap, folder, tmp_path, model, distortion):
    focal = [1.2 * made.WIDTH] if model == "RADIAL" else [1.2 * made.WIDTH, 1.21 * made.WIDTH]
    parameters = [*focal, made.WIDTH / 2, made.HEIGHT / 2, *distortion]
    scene = tmp_path / "scene"
    shutil.copytree(folder, scene)
    changed = pycolmap.Reconstruction(str(scene / "sparse"))
    changed.cameras[1].model = getattr(pycolmap.CameraModelId, model)
    changed.cameras[1].params = parameters
    changed.write(str(scene / "sparse"))
    skep.Job.plan(scene, tmp_path / "run").close()

    camera = pycolmap.Camera(model=model, width=made.WIDTH, height=made.HEIGHT, params=parameters)
    options = pycolmap.UndistortCameraOptions()
    bitmap = pycolmap.Bitmap.read(str(scene / "images" / "0.png"), True)
    image, expected = pycolmap.undistort_image(options, bitmap, camera)
    (own,) = pycolmap.Reconstruction(str(tmp_path / "run" / "sparse")).cameras.values()
    assert (own.width, own.height) == (expected.width, expected.height)
    np.testing.assert_allclose(own.params, expected.params, rtol=1e-9)
    found = pycolmap.Bitmap.read(str(tmp_path / "run" / "images" / "0.png"), True).to_array()
    assert np.abs(found.astype(int) - image.to_array().astype(int)).max() <= 1
