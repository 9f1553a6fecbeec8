"""The example runs and leaves pictures."""

import os
import subprocess
import sys

EXAMPLES = os.path.join(os.path.dirname(__file__), "../../examples")


def test_the_board_is_shown(need, tmp_path):
    need("matplotlib")
    command = [sys.executable, "python/board.py", "--quick", "data/board", str(tmp_path)]
    ran = subprocess.run(command, capture_output=True, text=True, cwd=EXAMPLES)
    assert ran.returncode == 0, ran.stderr
    points = next(line for line in ran.stdout.splitlines() if line.endswith(" points"))
    assert int(points.split()[0]) > 50_000
    for name in ("maps.png", "cloud.png"):
        picture = (tmp_path / name).read_bytes()
        assert picture.startswith(b"\x89PNG") and len(picture) > 20_000
