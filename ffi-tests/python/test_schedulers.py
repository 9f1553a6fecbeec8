"""The files of `skep plan` for schedulers: their tasks give the same bits as a run in one process."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import made
import pytest

OPTIONS = ["--quiet", "--schedule", made.TWO_SCALES, "--set", "fusion.min_agreeing_views=2"]
CYCLES = 4


@pytest.fixture(scope="module")
def scene(tmp_path_factory) -> Path:
    return made.scene_folder(tmp_path_factory.mktemp("scene"))


@pytest.fixture(scope="module")
def expected(program, scene, tmp_path_factory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("one")
    succeed([program, "reconstruct", scene, "--output", folder, *OPTIONS])
    return made.results(folder)


def succeed(command, **options) -> str:
    """Runs a command and returns what it prints."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def plan(program, scene, folder, *arguments):
    assert succeed([program, "plan", scene, "--output", folder, *OPTIONS, *arguments]) == ""


def test_open_job_description(program, scene, expected, need, tmp_path):
    need("openjd.cli")
    folder, template = tmp_path / "a run", tmp_path / "job.json"
    plan(program, scene, folder, "--openjd", template)
    described = json.loads(template.read_text())
    steps = described["steps"]
    names = [f"{kind}{cycle:02}" for cycle in range(CYCLES) for kind in ("Search", "Check", "Next")]
    assert [step["name"] for step in steps] == [*names, "Finish", "Fuse"]
    assert described["parameterDefinitions"][0]["default"] == "a run", "beside the file"
    # Few views are one range: several of them, to run several tasks of a step.
    for step in steps:
        if "parameterSpace" in step:
            parameter = step["parameterSpace"]["taskParameterDefinitions"][0]
            assert parameter["range"] == [f"0..{len(made.PLACES)}"]
            parameter["range"] = ["0..2", f"2..{len(made.PLACES)}"]
    template.write_text(json.dumps(described))
    openjd = [sys.executable, "-m", "openjd"]
    succeed([*openjd, "check", template])
    succeed([*openjd, "run", template, "--step", "Fuse", "--run-dependencies", "-p", f"Skep={program}"])
    assert made.results(folder) == expected


SBATCH = """#!/usr/bin/env bash
# Does what sbatch would: notes its arguments, and runs each task of the job at once, the last one first.
set -euo pipefail
printf '%s\\n' "$*" >>"$NOTES"
array=none
while [[ $1 == --* ]]; do
    case $1 in
    --array=0-*) array=${1#--array=0-} ;;
    --dependency=afterok:*) [ "${1##*:}" = "$(($(wc -l <"$NOTES") - 1))" ] || exit 3 ;;
    esac
    shift
done
if [ "$array" = none ]; then
    bash "$@" >&2
else
    for index in $(seq "$array" -1 0); do SLURM_ARRAY_TASK_ID=$index bash "$@" >&2; done
fi
echo "$(wc -l <"$NOTES");cluster"
"""


@pytest.fixture
def slurm(tmp_path) -> dict[str, str]:
    """An environment with a program that stands for sbatch."""
    (tmp_path / "bin").mkdir()
    sbatch = tmp_path / "bin/sbatch"
    sbatch.write_text(SBATCH)
    sbatch.chmod(0o755)
    path = f"{tmp_path}/bin:{os.environ['PATH']}"
    return {**os.environ, "PATH": path, "NOTES": str(tmp_path / "notes")}


def test_slurm(program, scene, expected, slurm, tmp_path):
    folder, script = tmp_path / "it's a run", tmp_path / "submit.sh"
    plan(program, scene, folder, "--slurm", script)
    text = script.read_text()
    assert f"\nviews={len(made.PLACES)}\nviews_per_task=16\ncycles={CYCLES}\n" in text
    script.write_text(text.replace("views_per_task=16", "views_per_task=4"))
    environment = {**slurm, "SKEP": program, "SLURM_CPUS_PER_TASK": "2", "SLURM_MEM_PER_NODE": "2000"}
    submit = ["bash", script, "--partition=long"]
    printed = succeed(submit, env=environment, cwd=tmp_path)
    assert made.results(folder) == expected

    notes = (tmp_path / "notes").read_text().splitlines()
    assert len(notes) == len(printed.splitlines()) == 3 * CYCLES + 2
    assert all(note.startswith("--partition=long --parsable --job-name=skep-") for note in notes)
    assert ["--dependency" in note for note in notes] == [False] + [True] * (len(notes) - 1)
    assert "--job-name=skep-check-c01 " in notes[4] and "--array=0-1 " in notes[4]
    assert notes[4].endswith("task check 1") and "--array" not in notes[5]

    # Submitted again: every task is done.
    succeed(submit, env=environment, cwd=tmp_path)
    assert made.results(folder) == expected


def test_a_task_that_fails_fails_its_job(program, scene, tmp_path):
    script = tmp_path / "submit.sh"
    plan(program, scene, tmp_path / "run", "--slurm", script)
    environment = {**os.environ, "SKEP": program, "SLURM_ARRAY_TASK_ID": "0"}
    too_early = subprocess.run(
        ["bash", script, "task", "check", "0"], env=environment, capture_output=True, text=True
    )
    assert too_early.returncode == 1 and "before the search of view" in too_early.stderr


def test_the_script_has_no_faults_that_shellcheck_knows(program, scene, tmp_path):
    if shutil.which("shellcheck") is None:
        pytest.skip("shellcheck is not installed")
    script = tmp_path / "submit.sh"
    plan(program, scene, tmp_path / "run", "--slurm", script)
    succeed(["shellcheck", script])
