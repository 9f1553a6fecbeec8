"""The stages of a run on single views, and the kernels."""

from concurrent.futures import ThreadPoolExecutor

import made
import numpy as np
import pytest
import skep


@pytest.fixture(scope="module")
def options():
    return skep.Options(threads=2, schedule_scales=made.TWO_SCALES, fusion_min_agreeing_views=2)


def run_by_hand(stepper, save=False):
    """All cycles in the documented order, views in parallel; with `save`, estimates go through bytes."""
    views = range(stepper.view_count)
    estimates, cycle = [], 0
    with ThreadPoolExecutor(3) as pool:
        while cycle is not None:
            if estimates and stepper[cycle].downscale != stepper[estimates[0].info.cycle].downscale:
                estimates = [stepper.upsample(cycle, view, estimates[view]) for view in views]

            def search(view):
                candidates = stepper.propagate(cycle, view, estimates)
                return stepper.search(cycle, view, estimates, candidates)

            searched = list(pool.map(search, views))
            estimates = list(pool.map(lambda view: stepper.check(cycle, view, searched), views))
            if save:
                estimates = [skep.Estimate.load(stepper, estimate.save()) for estimate in estimates]
            cycle = stepper.next(cycle, estimates)
    return estimates


@pytest.mark.parametrize("save", [False, True])
def test_stepper_give_the_bits_of_a_whole_run(scene, options, save):
    whole = skep.reconstruct(scene, options)
    stepper = skep.Stepper(scene, options)
    estimates = run_by_hand(stepper, save)
    for view in range(stepper.view_count):
        part = stepper.finish(view, estimates)
        assert part.view == view and np.array_equal(part.depth, whole[view].depth)
        assert np.array_equal(part.validated_normal, whole[view].validated_normal)
        assert np.array_equal(part.status, whole[view].status)
        assert part.sources == stepper.sources(view) == whole[view].sources


def test_an_estimate_knows_its_view_and_its_cycle(scene, options):
    stepper = skep.Stepper(scene, options)
    assert (len(stepper), stepper.view_count) == (4, len(scene))
    assert stepper[0] == skep.Cycle(downscale=2, cycle_on_scale=0, food_sources=3, iterations=2)
    assert stepper.size(0, 0) == (made.WIDTH // 2, made.HEIGHT // 2) and stepper.size(3, 0) == (
        made.WIDTH,
        made.HEIGHT,
    )
    searched = [stepper.search(0, view) for view in range(len(scene))]
    checked = stepper.check(0, 2, searched)
    assert not searched[2].info.is_checked and checked.info.is_checked
    assert (checked.info.view, checked.info.cycle, checked.size) == (2, 0, stepper.size(0, 2))
    maps = checked.maps()
    assert maps.depth.shape == maps.validated.shape == (made.HEIGHT // 2, made.WIDTH // 2)
    assert maps.validated.dtype == bool and maps.validated.sum() == checked.info.validated > 0
    assert maps.normal.shape == (*maps.depth.shape, 3) and maps.cost.min() >= 0
    with pytest.raises(skep.ArgumentError):
        skep.Estimate.load(stepper, checked.save()[:-1])
    with pytest.raises(skep.ArgumentError):
        stepper.finish(0, searched)


def test_a_run_can_start_from_the_hosts_own_maps(scene, options):
    options["cross_view_averaging"] = 0
    stepper = skep.Stepper(scene, options)
    last = len(stepper) - 1
    estimates = [
        skep.Estimate.from_maps(stepper, last, view, photograph.depth, photograph.normal)
        for view, photograph in enumerate(made.photographs())
    ]
    maps = estimates[0].maps()
    np.testing.assert_allclose(maps.depth, made.photographs()[0].depth, rtol=1e-6)
    assert maps.validated.all() and stepper.next(last, estimates) is None
    found = stepper.finish(0, estimates)
    np.testing.assert_allclose(found.depth, made.photographs()[0].depth, rtol=1e-6)
    half = np.arange(made.WIDTH) % 2 * np.ones((made.HEIGHT, 1))
    photograph = made.photographs()[0]
    estimate = skep.Estimate.from_maps(stepper, last, 0, photograph.depth, photograph.normal, half, half)
    assert np.array_equal(estimate.maps().validated, half == 1) and np.array_equal(estimate.maps().cost, half)
    with pytest.raises(skep.ArgumentError, match="depth has shape"):
        skep.Estimate.from_maps(stepper, 0, 0, photograph.depth, photograph.normal)


def test_homographies_carry_points_of_a_plane_from_view_to_view():
    reference, source = made.photographs()[0].camera, made.photographs()[4].camera
    normal = np.array([0.2, -0.1, -1.0]) / np.linalg.norm([0.2, -0.1, -1.0])
    planes = np.array([skep.plane_through(reference, 40.5, 30, depth, normal) for depth in (3.5, 4, 5)])
    homographies = skep.plane_homographies(reference, source, planes)
    assert homographies.shape == (3, 3, 3)
    for (*direction, distance), homography in zip(planes, homographies):
        for pixel in ([40.5, 30, 1], [10, 60, 1]):
            ray = np.linalg.inv(reference.K) @ pixel
            point = ray * (-distance / (ray @ direction))
            there = source.K @ (source.R @ (reference.R.T @ (point - reference.t)) + source.t)
            mapped = homography @ pixel
            np.testing.assert_allclose(mapped[:2] / mapped[2], there[:2] / there[2], atol=1e-9)


def test_patches_match_best_at_the_true_plane():
    first, second = made.photographs()[:2]
    pixels = np.array([(20, 15), (48, 36), (75, 60)])
    window, images = skep.NccWindow(), [skep.PackedImage(photograph.image) for photograph in (first, second)]
    itself = skep.patch_ncc(window, images[0], images[0], pixels, np.tile(np.eye(3), (3, 1, 1)))
    np.testing.assert_allclose(itself, 1, atol=1e-4)

    def ncc(factor):
        normals, depths = (
            first.normal[pixels[:, 1], pixels[:, 0]],
            first.depth[pixels[:, 1], pixels[:, 0]] * factor,
        )
        at = zip(pixels, depths, normals)
        planes = [skep.plane_through(first.camera, x, y, depth, normal) for (x, y), depth, normal in at]
        return skep.patch_ncc(
            window, *images, pixels, skep.plane_homographies(first.camera, second.camera, planes)
        )

    assert (ncc(1) > 0.9).all() and (ncc(1) > ncc(1.1)).all() and (ncc(1) > ncc(0.9)).all()
    assert skep.patch_ncc(window, *images, np.zeros((0, 2), int), np.zeros((0, 3, 3))).shape == (0,)
    with pytest.raises(skep.ArgumentError, match="pixels has shape"):
        skep.patch_ncc(window, *images, pixels[:2], np.zeros((3, 3, 3)))
    with pytest.raises(skep.ArgumentError, match="pixels"):
        skep.patch_ncc(window, *images, [(200, 0)], [np.eye(3)])
    with pytest.raises(skep.ArgumentError, match="radius"):
        skep.NccWindow(radius=0)
