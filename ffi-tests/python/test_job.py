"""Runs in a folder."""

import made
import pytest
import skep


@pytest.fixture
def folder(tmp_path):
    scene = made.scene()
    scene.add_points(*made.points())
    scene.write_colmap(tmp_path / "scene")
    return tmp_path


def test_a_run_in_a_folder_goes_on_after_an_exception_and_gives_the_bits_of_a_run_in_memory(folder):
    options = made.options()
    read = skep.Scene.read(folder / "scene")
    skep.reconstruct(read, options).cloud.write_ply(folder / "expected.ply")

    class Enough(Exception):
        pass

    def progress(at):
        if at.done > 0.3:
            raise Enough

    with skep.Job.plan(folder / "scene", folder / "run", options) as job:
        assert job.view_count == len(read) and job.cycle_count > 1
        needs = job.needs
        assert 0 < needs.least_memory <= needs.memory and needs.disk > 0 and needs.cpu_seconds > 0
        with pytest.raises(Enough):
            job.run(progress)
        assert job.is_done(skep.Task.SEARCH, cycle=0, view=0) and not job.is_done(skep.Task.FUSE)
        with pytest.raises(skep.FileError, match="another process"):
            skep.Job.plan(folder / "scene", folder / "run", options)
    with skep.Job.plan(folder / "scene", folder / "run", options) as job:
        assert job.run() > 0
    assert (folder / "run" / "fused.ply").read_bytes() == (folder / "expected.ply").read_bytes()


def test_tasks_of_a_planned_run(folder):
    skep.Job.plan(folder / "scene", folder / "run", made.options()).close()
    with skep.Job.open(folder / "run", skep.Options(threads=1)) as job:
        with pytest.raises(skep.ArgumentError, match="before the search"):
            job.run_task(skep.Task.CHECK, cycle=0, view=0)
        job.run_task(skep.Task.SEARCH, cycle=0, view=2)
        job.run_task(skep.Task.SEARCH, cycle=0, view=2)
        assert job.is_done(skep.Task.SEARCH, cycle=0, view=2)
        assert 2 in job.views_read(2) and len(job.views_read(2)) > 1
    assert (folder / "run" / "run" / "estimates" / "cycle00-00002.searched").is_file()


def test_a_changed_option_begins_the_run_anew_and_says_so(folder):
    skep.Job.plan(folder / "scene", folder / "run", made.options()).close()
    other = made.options()
    other.seed = 5
    with skep.Job.plan(folder / "scene", folder / "run", other) as job:
        assert any("option seed" in notice for notice in job.notices)
    with pytest.raises(skep.ArgumentError, match="memory"):
        other.memory = 1000
        skep.Job.plan(folder / "scene", folder / "run", other)
