import importlib
import os
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import made
import pytest
import skep


@pytest.fixture(scope="session")
def scene() -> skep.Scene:
    return made.scene()


@pytest.fixture(scope="session")
def result(scene: skep.Scene) -> skep.Result:
    return skep.reconstruct(scene, made.options())


@pytest.fixture(scope="session")
def program() -> str:
    """The command line, which `ffi-tests/test` builds before."""
    found = os.environ.get("SKEP", str(Path(__file__).parents[2] / "target/release/skep"))
    if not os.path.isfile(found):
        message = f"{found} is missing; `cargo build --release --features cli` makes it"
        pytest.fail(message) if os.environ.get("CI") else pytest.skip(message)
    return found


@pytest.fixture(scope="session")
def need() -> Callable[[str], ModuleType]:
    """A package that may be missing: then the test is skipped, but fails where CI is set."""

    def find(name: str) -> ModuleType:
        try:
            return importlib.import_module(name)
        except ImportError as error:
            if os.environ.get("CI"):
                pytest.fail(f"{name} cannot be imported: {error}")
            pytest.skip(f"{name} cannot be imported: {error}")

    return find
