"""The command line of the package."""

import os
import subprocess
import sys

import made
import pytest
import skep

QUICK = ["--set", f"schedule.scales={made.TWO_SCALES}", "--threads", "2"]


def run(*arguments: object, path: str = "/usr/bin:/bin") -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "skep", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PATH": path})


@pytest.fixture
def without_program() -> str:
    """A PATH with the command of this package, which is not the program."""
    return os.path.dirname(sys.executable)


def test_a_scene_is_reconstructed_and_the_run_goes_on(tmp_path, without_program):
    scene = made.scene_folder(tmp_path / "scene")
    made_now = run("reconstruct", scene, "-o", tmp_path / "run", *QUICK, path=without_program)
    assert made_now.returncode == 0, made_now.stderr
    assert made_now.stdout.endswith(f"points in {tmp_path / 'run' / 'fused.ply'}\n")
    assert (tmp_path / "run" / "fused.ply").is_file() and (tmp_path / "run" / "stereo").is_dir()
    again = run("reconstruct", scene, "-o", tmp_path / "run", *QUICK, "--quiet", path=without_program)
    assert (again.returncode, again.stdout) == (0, "")


def test_errors_are_sentences(tmp_path, without_program):
    missing = run("reconstruct", tmp_path / "nowhere", path=without_program)
    assert missing.returncode == 1 and "nowhere" in missing.stderr and "Traceback" not in missing.stderr
    for setting, words in (("nonsense=1", "nonsense"), ("seed", "NAME=VALUE")):
        wrong = run("reconstruct", tmp_path, "--set", setting, path=without_program)
        assert wrong.returncode == 1 and words in wrong.stderr
    assert run("reconstruct", path=without_program).returncode == 2
    other = run("fuse", tmp_path, path=without_program)
    assert other.returncode == 2 and "cargo install" in other.stderr
    assert run("--version", path=without_program).stdout == f"skep {skep.__version__}\n"


def test_the_program_is_run_where_path_has_it(tmp_path, without_program):
    program = tmp_path / "skep"
    program.symlink_to("/bin/echo")
    found = run("fuse", "RUN", "--quiet", path=f"{without_program}:{tmp_path}")
    assert found.stdout == "fuse RUN --quiet\n"


def test_the_package_installs_the_command(without_program):
    command = os.path.join(without_program, "skep")
    told = subprocess.run(
        [command, "--version"], capture_output=True, text=True, env={"PATH": without_program}
    )
    assert told.stdout == f"skep {skep.__version__}\n"
