"""The link under every kind of fault: commands arrive once, in order, or are reported as missed.

    python -m tests.benchmarks.link_faults [--steps N] [--seed N] [--json]

A hypothesis state machine (tests/bad_wire.py) does anything to a simulated wire between a device
and a host, at any moment of a virtual clock: cuts it, lets it stall, flips bits, loses, doubles and
mixes up what travels, and starts either end anew. After every 10 ms of virtual time tests/
link_world.py compares what the host was told with what was really asked for. At the end of each
story the wire is mended, and both ends must agree on the fate of every command. Anything that does
not hold ends the run with the shortest story that shows it.
"""

import argparse
import json
import sys
import time
from typing import Final

from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis.stateful import run_state_machine_as_test

from tests.support.link_state_machine import BadWire

STORY: Final = 50  # steps of a story
_BATCH: Final = 200  # stories between two looks at the count


def main() -> int:
    """Run, print what happened, and return 0; a failure raises."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
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
        print(
            f"{_steps(BadWire.total):,} steps in {time.monotonic() - began_s:.0f} s",
            file=sys.stderr,
        )
    total = {**BadWire.total, "steps": _steps(BadWire.total), "oldest obeyed ms": BadWire.oldest_ms}
    # Given before a host came for the first time, or shortly before an end was started anew.
    total["commands of no host"] = total["commands"] - total["delivered"] - total["missed"]
    for name in sorted(total):
        print(f"{name:24} {total[name]:10,}")
    if options.json:
        results = [
            {"name": name, "preset": "", "value": value, "unit": "", "goal": None}
            for name, value in sorted(total.items())
        ]
        print(json.dumps({"benchmark": "link_faults", "results": results}))
    return 0


def _steps(total: dict[str, int]) -> int:
    return sum(count for name, count in total.items() if name.startswith("step "))


if __name__ == "__main__":
    sys.exit(main())
