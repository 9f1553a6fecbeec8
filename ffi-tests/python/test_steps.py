"""A run taken apart, and the kernels."""

from concurrent.futures import ThreadPoolExecutor

import made
import numpy as np
import pytest
import skep

SCALES = [(1, 3, 2, 1, 1), (0, 3, 1, 1, 1)]


@pytest.fixture(scope="module")
def options():
    return skep.Options(threads=2, scales=SCALES, fusion_min_views=2)


def solve(steps, save=False):
    """All steps as their documentation tells, views at the same time; states go through bytes when asked."""
    views = range(steps.view_count)
    states, step = [], 0
    with ThreadPoolExecutor(3) as pool:
        while step is not None:
            if states and steps[step].reduction != steps[states[0].info.step].reduction:
                states = [steps.hand_up(step, view, states[view]) for view in views]

            def search(view):
                offers = steps.propagate(step, view, states)
                return steps.search(step, view, states, offers)

            searched = list(pool.map(search, views))
            states = list(pool.map(lambda view: steps.check(step, view, searched), views))
            if save:
                states = [skep.State.load(steps, state.save()) for state in states]
            step = steps.next(step, states)
    return states


@pytest.mark.parametrize("save", [False, True])
def test_steps_give_the_bits_of_a_whole_run(scene, options, save):
    whole = skep.reconstruct(scene, options)
    steps = skep.Steps(scene, options)
    states = solve(steps, save)
    for view in range(steps.view_count):
        part = steps.finish(view, states)
        assert part.view == view and np.array_equal(part.depth, whole[view].depth)
        assert np.array_equal(part.validated_normal, whole[view].validated_normal)
        assert np.array_equal(part.outcome, whole[view].outcome)
        assert part.sources == steps.sources(view) == whole[view].sources


def test_a_state_tells_what_it_is(scene, options):
    steps = skep.Steps(scene, options)
    assert (len(steps), steps.view_count) == (4, len(scene))
    assert steps[0] == skep.Step(reduction=2, cycle=0, foods=3, iterations=2)
    assert steps.size(0, 0) == (made.WIDTH // 2, made.HEIGHT // 2) and steps.size(3, 0) == (made.WIDTH, made.HEIGHT)
    searched = [steps.search(0, view) for view in range(len(scene))]
    checked = steps.check(0, 2, searched)
    assert not searched[2].info.is_checked and checked.info.is_checked
    assert (checked.info.view, checked.info.step, checked.size) == (2, 0, steps.size(0, 2))
    maps = checked.maps()
    assert maps.depth.shape == maps.validated.shape == (made.HEIGHT // 2, made.WIDTH // 2)
    assert maps.validated.dtype == bool and maps.validated.sum() == checked.info.validated > 0
    assert maps.normal.shape == (*maps.depth.shape, 3) and maps.cost.min() >= 0
    with pytest.raises(skep.ArgumentError):
        skep.State.load(steps, checked.save()[:-1])
    with pytest.raises(skep.ArgumentError):
        steps.finish(0, searched)


def test_a_run_can_start_from_the_hosts_own_maps(scene, options):
    options["average_views"] = 0
    steps = skep.Steps(scene, options)
    last = len(steps) - 1
    states = [
        skep.State.from_maps(steps, last, view, photograph.depth, photograph.normal)
        for view, photograph in enumerate(made.photographs())
    ]
    maps = states[0].maps()
    np.testing.assert_allclose(maps.depth, made.photographs()[0].depth, rtol=1e-6)
    assert maps.validated.all() and steps.next(last, states) is None
    found = steps.finish(0, states)
    np.testing.assert_allclose(found.depth, made.photographs()[0].depth, rtol=1e-6)
    half = np.arange(made.WIDTH) % 2 * np.ones((made.HEIGHT, 1))
    photograph = made.photographs()[0]
    state = skep.State.from_maps(steps, last, 0, photograph.depth, photograph.normal, half, half)
    assert np.array_equal(state.maps().validated, half == 1) and np.array_equal(state.maps().cost, half)
    with pytest.raises(skep.ArgumentError, match="depth has shape"):
        skep.State.from_maps(steps, 0, 0, photograph.depth, photograph.normal)


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
    window, samples = skep.Window(), [skep.Samples(photograph.image) for photograph in (first, second)]
    itself = skep.patch_ncc(window, samples[0], samples[0], pixels, np.tile(np.eye(3), (3, 1, 1)))
    np.testing.assert_allclose(itself, 1, atol=1e-4)

    def ncc(factor):
        normals, depths = first.normal[pixels[:, 1], pixels[:, 0]], first.depth[pixels[:, 1], pixels[:, 0]] * factor
        at = zip(pixels, depths, normals)
        planes = [skep.plane_through(first.camera, x, y, depth, normal) for (x, y), depth, normal in at]
        return skep.patch_ncc(window, *samples, pixels, skep.plane_homographies(first.camera, second.camera, planes))

    assert (ncc(1) > 0.9).all() and (ncc(1) > ncc(1.1)).all() and (ncc(1) > ncc(0.9)).all()
    assert skep.patch_ncc(window, *samples, np.zeros((0, 2), int), np.zeros((0, 3, 3))).shape == (0,)
    with pytest.raises(skep.ArgumentError, match="pixels has shape"):
        skep.patch_ncc(window, *samples, pixels[:2], np.zeros((3, 3, 3)))
    with pytest.raises(skep.ArgumentError, match="pixels"):
        skep.patch_ncc(window, *samples, [(200, 0)], [np.eye(3)])
    with pytest.raises(skep.ArgumentError, match="radius"):
        skep.Window(radius=0)
