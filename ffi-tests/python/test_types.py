"""The package is typed: its interface and its own code."""

import json
import os
import subprocess
import sys

import pytest
import skep

ROOT = os.path.join(os.path.dirname(__file__), "../..")
USE = """
import copy

import numpy as np
import skep
from numpy.typing import NDArray
from typing_extensions import assert_type

scene = skep.Scene()
image = np.zeros((4, 4, 3), dtype=np.uint8)
number = scene.add_view(image, skep.Camera(np.eye(3)), order="bgr", depth_range=(1, 2))
assert_type(number, int)
options = skep.Options("paper", seed=1, fusion_min_agreeing_views=2)
assert_type(options.fusion_min_agreeing_views, int)
assert_type(options.check_depth_tolerance, float)
assert_type(options.schedule_scales, str)
options.threads = 2
options.min_agreeing_views = 3


def progress(progress: skep.Progress) -> object:
    assert_type(progress.phase, skep.Phase)
    return skep.CANCEL if progress.done > 0.5 else None


result = skep.reconstruct(scene, options, progress)
assert_type(result[0].depth, NDArray[np.float32])
assert_type(result[0].statistics.status_counts[skep.PixelStatus.MASKED], int)
assert_type(result.cloud.positions, NDArray[np.float64])
estimate: skep.Estimate = skep.Stepper(scene).search(0, 0)
scene.add_view(image, skep.Camera(np.eye(3)), white=255)
assert_type(copy.deepcopy(result), skep.Result)
scene.add_view(image, skep.Camera(np.eye(3)), order="gbr")  # wrong
scene.set_mask("0", None)  # wrong
skep.Options("best")  # wrong
"""


def mypy(*arguments):
    cache = os.path.join(ROOT, "target/mypy")
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", cache, *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT)


def pyright(*arguments):
    """What pyright says of files. Where it cannot fetch its program the test is skipped, but fails in CI."""
    command = [sys.executable, "-m", "pyright", "--pythonpath", sys.executable, "--outputjson", *arguments]
    ran = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    if not ran.stdout.startswith("{"):
        end = pytest.fail if os.environ.get("CI") else pytest.skip
        end(f"pyright does not run: {ran.stderr[-300:]}")
    return json.loads(ran.stdout)["generalDiagnostics"]


def wrong_lines():
    return [number for number, line in enumerate(USE.splitlines(), 1) if line.endswith("# wrong")]


def test_the_package_is_typed_throughout(need):
    need("mypy")
    checked = mypy("src/python/skep")
    assert checked.returncode == 0, checked.stdout


def test_pyright_finds_nothing_either(need):
    need("pyright")
    found = pyright("src/python/skep")
    assert not [each for each in found if each["severity"] == "error"], found


def test_pyright_tells_users_what_is_wrong_and_nothing_else(need, tmp_path):
    need("pyright")
    use = tmp_path / "use.py"
    use.write_text(USE)
    found = [each for each in pyright(str(use)) if each["severity"] == "error"]
    assert [each["range"]["start"]["line"] + 1 for each in found] == wrong_lines(), found


def test_users_are_told_what_is_wrong_and_nothing_else(need, tmp_path):
    need("mypy")
    use = tmp_path / "use.py"
    use.write_text(USE)
    checked = mypy(str(use))
    told = [int(line.split(":")[1]) for line in checked.stdout.splitlines() if ": error: " in line]
    assert told == wrong_lines(), checked.stdout + checked.stderr


def test_everything_public_is_there_and_described():
    for name in skep.__all__:
        assert getattr(skep, name).__doc__, name
    assert skep.__version__.count(".") == 2 and skep.simd_level_name() in ("scalar", "baseline", "v3")
