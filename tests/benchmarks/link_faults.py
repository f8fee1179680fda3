"""The link under every kind of fault: commands arrive once, in order, or are reported as missed.

Contacts may be lost, but none arrives late, behind a command or behind its end.

    python -m tests.benchmarks.link_faults [--steps N] [--seed N] [--json]

A hypothesis state machine (tests/support/link_state_machine.py) does anything to a simulated wire
between a device and a host, at any moment of a virtual clock: cuts it, lets it stall, flips bits,
loses, doubles and mixes up what travels, and starts either end again. After every 10 ms of virtual
time tests/support/link_simulator.py compares what the host was told with what was really asked for.
At the end of each story the wire is mended, and both ends must agree on the fate of every command.
Anything that does not hold ends the run with the shortest story that shows it.
"""

import sys
import time
from typing import Final

from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis.stateful import run_state_machine_as_test

from tests.support.link_state_machine import BadWire

from .results import Results, command_line, say

STORY: Final = 50  # steps of a story
_BATCH: Final = 200  # stories between two looks at the count


def main() -> int:
    options = command_line(__doc__, steps=100_000, seed=1).parse_args()
    how = settings(
        max_examples=_BATCH,
        stateful_step_count=STORY,
        deadline=None,
        database=None,
        phases=[Phase.generate, Phase.shrink],
        suppress_health_check=list(HealthCheck),
    )
    began_s, batch = time.monotonic(), 0
    while _steps(BadWire.total) < options.steps:
        run_state_machine_as_test(seed(options.seed + batch)(BadWire), settings=how)
        batch += 1
        say(f"{_steps(BadWire.total):,} steps in {time.monotonic() - began_s:.0f} s")
    total = {**BadWire.total, "steps": _steps(BadWire.total), "oldest obeyed ms": BadWire.oldest_ms}
    # Given before a host came for the first time, or shortly before an end was started anew.
    total["commands of no host"] = total["commands"] - total["delivered"] - total["missed"]
    results = Results("link_faults")
    for name in sorted(total):
        results.note(name, total[name])
    results.finish(options.json)
    return 0


def _steps(total: dict[str, int]) -> int:
    return sum(count for name, count in total.items() if name.startswith("step "))


if __name__ == "__main__":
    sys.exit(main())
