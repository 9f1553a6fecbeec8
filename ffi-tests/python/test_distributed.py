"""Runs on a cluster of Dask: the same bits as in one process, also when workers are killed."""

import os
import signal
import threading
import time

import made
import pytest
import skep

# Several seconds on one core, in many tasks.
SCALES = "downscale=2 food_sources=4 iterations=8+3x4; downscale=1 food_sources=3 iterations=4+2x3"


def options() -> skep.Options:
    return made.options(schedule_scales=SCALES, threads=0)


@pytest.fixture(scope="module")
def client(need):
    distributed = need("distributed")
    with (
        distributed.LocalCluster(
            n_workers=4, threads_per_worker=1, processes=True, memory_limit="2GiB", dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    """The results of one process, and the number of points."""
    folder = tmp_path_factory.mktemp("one")
    scene = made.scene_folder(folder / "scene")
    with skep.Job.plan(scene, folder / "run", options()) as job:
        points = job.run()
    return made.results(folder / "run"), points


def records(folder) -> int:
    """The number of tasks that are done."""
    tasks = folder / "run/tasks"
    return len(list(tasks.glob("*.json"))) if tasks.is_dir() else 0


def wait_for(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_run_whose_worker_is_killed_gives_the_same_bits(client, expected, tmp_path):
    from skep import distributed

    scene, folder = made.scene_folder(tmp_path / "scene"), tmp_path / "run"
    found = []
    run = threading.Thread(
        target=lambda: found.append(
            distributed.reconstruct(scene, client, folder=folder, options=options())
        )
    )
    run.start()
    wait_for(lambda: records(folder) >= 15)
    killed = next(iter(client.run(os.getpid).values()))
    os.kill(killed, signal.SIGKILL)
    at_the_kill = records(folder)
    run.join()
    files, points = expected
    assert at_the_kill < records(folder), "the worker was killed in the middle"
    assert found == [distributed.Summary(str(folder), points)]
    assert made.results(folder) == files
    assert not (folder / "run/estimates").exists()

    # The same call again finds everything done.
    # A killed process may leave a temporary file, which the next call removes.
    before = {path: path.stat().st_mtime_ns for path in (folder / "run/tasks").glob("*.json")}
    assert distributed.reconstruct(scene, client, folder=folder, options=options()) == found[0]
    assert {path: path.stat().st_mtime_ns for path in (folder / "run/tasks").glob("*.json")} == before


def test_ctrl_c_stops_the_workers_and_the_run_goes_on_anywhere(client, expected, tmp_path):
    from skep import distributed

    scene, folder = made.scene_folder(tmp_path / "scene"), tmp_path / "run"

    def interrupt():
        wait_for(lambda: records(folder) >= 10)
        # To the main thread, or its wait would not end.
        signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    thread = threading.Thread(target=interrupt)
    thread.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            distributed.reconstruct(scene, client, folder=folder, options=options())
    finally:
        thread.join()
        signal.signal(signal.SIGINT, before)
    done = records(folder)
    time.sleep(0.5)
    assert records(folder) == done, "no task goes on"
    # The folder is unlocked, and one process does the rest.
    with skep.Job.plan(scene, folder, options()) as job:
        points = job.run()
    assert (made.results(folder), points) == expected


def test_a_failure_of_a_task_is_raised_with_its_text_and_stops_the_others(client, expected, tmp_path):
    from skep import distributed

    scene, folder = made.scene_folder(tmp_path / "scene"), tmp_path / "run"
    with skep.Job.plan(scene, folder, options()) as job:
        job.run_task(skep.Task.SEARCH, cycle=0, view=2)
    damaged = folder / "run/estimates/cycle00-00002.searched"
    damaged.write_bytes(damaged.read_bytes()[:-1])
    with pytest.raises(skep.FileError, match="cycle00-00002.searched: damaged"):
        distributed.reconstruct(scene, client, folder=folder, options=options(), retries=0)
    # The folder is unlocked; a run in one process compares the files with the records.
    with skep.Job.plan(scene, folder, options()) as job:
        job.run()
    assert made.results(folder) == expected[0]
