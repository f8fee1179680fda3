"""Run one harness under atheris: python -m tests.fuzz.under_atheris NAME [libFuzzer's options].

Our own modules are instrumented as they are imported, so nothing of ours may be imported before.
"""

from __future__ import annotations

import importlib
import sys

import atheris


def main() -> None:
    """Fuzz until libFuzzer's options say that it is enough."""
    name, *options = sys.argv[1:]
    with atheris.instrument_imports(include=["controller", "host", "tomllib"]):
        harness = importlib.import_module(f"tests.fuzz.{name}")
    atheris.Setup([sys.argv[0], *options], harness.one)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
