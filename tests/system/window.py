"""The application on a screen, by a real pointer: a line for each scenario with its seconds.

    python -m tests.system.window [SCENARIO ...] [--json] [--keep DIR]

It needs Xvfb, xdotool and ImageMagick's `import`. Each scenario begins with fresh settings and
data; --keep saves the last picture of each.
"""

import argparse
import json
import sys
import tempfile
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.support.x_programs import xvfb

from . import lessons, plays, walk
from .desktop import Desk, Scenario, ScenarioError, missing

SIZE: Final = (1280, 720)
SCENARIOS: Final[dict[str, Scenario]] = {
    do.__name__: do
    for do in (
        plays.first_picture,
        plays.clicks,
        plays.pinch_and_twist,
        plays.from_install,
        plays.introduction,
        lessons.teach_swipe,
        lessons.teach_double_tap,
        lessons.keep_and_undo,
        lessons.killed_orb,
        walk.walk_by_mouse,
        walk.walk_by_keys,
        walk.walk_by_pad,
        walk.walk_by_orb,
    )
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a scenario went."""

    name: str
    seconds: float
    trouble: str  # "" if it went well
    seen: dict[str, float]

    def line(self) -> str:
        """Return it for people."""
        figures = ", ".join(f"{key} {value:.4g}" for key, value in self.seen.items())
        said = f"FAILED: {self.trouble}" if self.trouble else "ok"
        return f"{self.name:24} {self.seconds:6.1f} s  {said}{'  ' if figures else ''}{figures}"


def run(name: str, keep: Path | None) -> Outcome:
    """Carry a scenario out on a screen of its own."""
    trouble, begun_s = "", time.monotonic()
    with ExitStack() as stack:
        home = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        display = stack.enter_context(xvfb(*SIZE))
        desk = Desk(display, home, stack)
        try:
            SCENARIOS[name](desk)
        except ScenarioError as error:
            trouble = str(error)
        seconds = time.monotonic() - begun_s
        if keep is not None and desk.window is not None:
            keep.mkdir(parents=True, exist_ok=True)
            desk.window.picture(keep / f"{name}.png")
    return Outcome(name, seconds, trouble, desk.seen)


def main() -> int:
    """Return 0 if every scenario went well, 1 if not, 2 if they cannot be run here."""
    parser = argparse.ArgumentParser(prog="python -m tests.system.window", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="SCENARIO", help=", ".join(SCENARIOS))
    parser.add_argument("--json", action="store_true", help="print one object a line")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="save the last picture of each")
    options = parser.parse_args()
    if unknown := set(options.names) - set(SCENARIOS):
        parser.error(f"there is no scenario {min(unknown)}; there are {', '.join(SCENARIOS)}")
    if absent := missing():
        parser.error(f"{', '.join(absent)} must be installed")
    well = True
    for name in options.names or SCENARIOS:
        outcome = run(name, options.keep)
        well = well and not outcome.trouble
        fields = {key: getattr(outcome, key) for key in outcome.__slots__}
        print(json.dumps(fields) if options.json else outcome.line(), flush=True)
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
