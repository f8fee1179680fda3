"""Examples of `examples/`, imported for tests."""

import importlib.util
from types import ModuleType

from tests.support import ROOT

EXAMPLES = ROOT / "examples"


def example(name: str) -> ModuleType:
    """Import an example, which runs what is not below `__main__`."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
