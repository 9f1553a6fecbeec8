import importlib
import os
from collections.abc import Callable
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
