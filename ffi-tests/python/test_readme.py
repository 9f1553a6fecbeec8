"""The README's lines of Python run as they stand there."""

from pathlib import Path

import made
import numpy as np


def test_the_readme_s_program_gives_depths_and_points() -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text()
    program = readme.split("```python\n")[1].split("```")[0]
    taken = made.photographs()
    names = {
        "photographs": [photograph.image for photograph in taken],
        "cameras": [(p.camera.K, p.camera.R, p.camera.t) for p in taken],
    }
    exec(program, names)
    validated = names["why_empty"] == 0
    truth = taken[0].depth
    assert validated.mean() > 0.5
    assert np.median(np.abs(names["depth"] / truth - 1)[validated]) < 0.005
    assert len(names["positions"]) == len(names["colors"]) > 1000
