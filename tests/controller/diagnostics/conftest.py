"""A doctor without its slow looks at the computer, which have tests of their own."""

import pytest

from controller.diagnostics import system_checks
from controller.diagnostics.report import Row, Verdict


@pytest.fixture
def quick_doctor(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out what has tests of its own and takes its time."""
    row = Row("computer", Verdict.GOOD, "left out")
    monkeypatch.setattr(system_checks, "runtime", lambda path: row)
