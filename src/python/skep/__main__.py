"""`python -m skep` and the command `skep` of the package: the command line.

Runs the program `skep` of Rust with all arguments as they are: the one in the package, which wheels have, or
one in PATH. A package that was built with `pip install .` does not contain it; without it `reconstruct` with
the arguments below and `--version` work all the same. `mesh` is always the package's own.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

import skep
from skep import _mesh

_PROGRAM = "skep"
_COMMANDS = tuple(
    "reconstruct plan search check next finish fuse view convert evaluate info completions man help".split()
)
_MISSING = (
    "skep: '{}' needs the program skep, which PATH does not have; 'cargo install --path . --features cli' in "
    "the source of skep installs it. The Python package alone has 'reconstruct', 'mesh' and --version"
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Does what the arguments say; returns the exit status: 0 when done, 1 after an error, 130 when
    interrupted. Wrong arguments exit with 2.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    is_mesh = given[:1] == ["mesh"]
    program = None if is_mesh else find_program()
    if program is not None:
        os.execv(program, [_PROGRAM, *given])
    if given and given[0] in _COMMANDS and given[0] != "reconstruct":
        print(_MISSING.format(given[0]), file=sys.stderr)
        return 2
    try:
        if is_mesh:
            return _mesh.main(given[1:])
        return _reconstruct(_parser().parse_args(given or ["--help"]))
    except ImportError as error:
        print(f"skep: {error}", file=sys.stderr)
        return 1
    except skep.Error as error:
        print(f"\nskep: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        rest = "" if is_mesh else "; the same command goes on where it stopped"
        print(f"\nskep: interrupted{rest}", file=sys.stderr)
        return 130


def find_program() -> str | None:
    """The program of Rust in the package, else in PATH. The command of this package has the same name: it is a
    script.
    """
    folders = [os.path.join(os.path.dirname(__file__), "_program"), *os.get_exec_path()]
    for folder in folders:
        file = os.path.join(folder, _PROGRAM)
        if os.path.isfile(file) and os.access(file, os.X_OK):
            with open(file, "rb") as opened:
                if opened.read(2) != b"#!":
                    return file
    return None


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(_PROGRAM, description="Dense multi-view stereo on the CPU.")
    parser.add_argument("--version", action="version", version=f"skep {skep.__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    # `main` takes it before; here it is only listed.
    commands.add_parser("mesh", help="make a mesh of the results of a run", add_help=False)
    command = commands.add_parser(
        "reconstruct", help="estimate depth maps and a cloud of a COLMAP scene; goes on after Ctrl-C"
    )
    add = command.add_argument
    add(
        "scene",
        type=Path,
        metavar="SCENE",
        help="folder with images/ and a COLMAP model in sparse/ or sparse/0/",
    )
    add("-o", "--output", type=Path, metavar="DIR", help="folder of the results (default: SCENE/dense)")
    add(
        "--preset",
        choices=["default", "fast", "paper"],
        default="default",
        help="option values to start from",
    )
    add("-t", "--threads", metavar="N", default="0", help="worker threads at most; 0 uses one for each core")
    add("--seed", metavar="N", default="0", help="seed of the random generator")
    add("--depth-range", nargs=2, type=float, metavar=("MIN", "MAX"), help="depths to search in every view")
    add("--set", action="append", default=[], metavar="NAME=VALUE", help="set an option; may be repeated")
    add("--fresh", action="store_true", help="begin anew where a run in the folder would go on")
    add("-q", "--quiet", action="store_true", help="print warnings and errors only")
    return parser


def _options(given: argparse.Namespace) -> skep.Options:
    options = skep.Options(given.preset)
    for setting in [f"threads={given.threads}", f"seed={given.seed}", *given.set]:
        name, equals, value = setting.partition("=")
        if not equals:
            raise skep.ArgumentError(f"--set is {setting}: must be NAME=VALUE, such as smoothness_reward=0.1")
        options[name.strip()] = value.strip()
    return options


def _reconstruct(given: argparse.Namespace) -> int:
    def show(progress: skep.Progress) -> None:
        if not given.quiet and sys.stderr.isatty():
            stage = progress.phase.name.lower()
            print(f"\r{progress.done:4.0%} {stage:8}", end="", file=sys.stderr, flush=True)

    output = given.output or given.scene / "dense"
    near, far = given.depth_range or (0.0, 0.0)
    options = _options(given)
    plan = skep.Job.plan
    with plan(given.scene, output, options, depth_range=(near, far), fresh=given.fresh, progress=show) as job:
        for notice in job.notices:
            print(f"\rskep: {notice}", file=sys.stderr)
        points = job.run(show)
    if points == 0:
        print("\rskep: the cloud is empty: see preview/ for which pixels have depths", file=sys.stderr)
    if not given.quiet:
        print(f"\r{points} points in {output / 'fused.ply'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
