"""Command lines, figures and the last line of JSON, as all benchmarks have them."""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from controller.simulator.session import TEST_SEEDS

if TYPE_CHECKING:
    from models.results.evaluation import Figure

Row = dict[str, Any]

BENCHMARK_SEED: Final = TEST_SEEDS.start + 10  # of people that nothing but reports sees


def command_line(doc: str | None, **defaults: Any) -> argparse.ArgumentParser:
    """Return a parser with --json and an option for each default; False makes it a flag."""
    spec = sys.modules["__main__"].__spec__
    parser = argparse.ArgumentParser(
        prog=f"python -m {spec.name}" if spec else None, description=(doc or "").splitlines()[0]
    )
    for name, default in {**defaults, "json": False}.items():
        option = f"--{name.replace('_', '-')}"
        if default is False:
            parser.add_argument(option, action="store_true")
        else:
            kind = Path if isinstance(default, Path) else type(default)
            words = "default: %(default)s"
            parser.add_argument(option, type=kind, default=default, help=words)
    return parser


def say(line: str) -> None:
    """Print a line of progress on standard error."""
    print(line, file=sys.stderr, flush=True)


def row(
    name: str, value: float | str | None, unit: str = "", *, preset: str = "",
    goal: float | None = None, **more: Any,
) -> Row:  # fmt: skip
    return {
        "name": name, "preset": preset, "value": value, **more, "unit": unit, "goal": goal,
    }  # fmt: skip


def figure_row(
    name: str, figure: Figure, unit: str = "1", *, preset: str = "", goal: float | None = None
) -> Row:
    """Return a result with its interval; what is not known is None."""
    value, low, high = (
        round(one, 6) if math.isfinite(one) else None
        for one in (figure.value, figure.low, figure.high)
    )
    return row(name, value, unit, preset=preset, goal=goal, low=low, high=high)


def show(result: Row) -> None:
    """Print a result: its name, value, interval and goal."""
    value = result["value"]
    text = value if isinstance(value, str) else "–" if value is None else f"{value:,.5g}"
    low, high, goal = (result.get(name) for name in ("low", "high", "goal"))
    span = "" if low is None or high is None else f"  {low:.4f} – {high:.4f}"
    aim = "" if goal is None else f"   goal {goal:g}"
    print(
        f"{result['name']:36} {result['preset']:10}{text:>12} {result['unit']}{span}{aim}",
        flush=True,
    )


class Results:
    """The results of a benchmark, printed as they come."""

    def __init__(self, benchmark: str) -> None:
        self.rows: list[Row] = []
        self._benchmark = benchmark

    def keep(self, result: Row) -> None:
        self.rows.append(result)
        show(result)

    def note(self, name: str, value: float | str | None, unit: str = "", **more: Any) -> None:
        """Print and keep a result; `more` is what `row` takes."""
        self.keep(row(name, value, unit, **more))

    def spread(self, name: str, values: list[float], unit: str, **more: Any) -> None:
        """Print and keep the median of some values, with the least and the greatest."""
        more |= {"least": min(values), "greatest": max(values)}
        self.note(name, statistics.median(values), unit, **more)

    def finish(self, as_json: bool, **more: Any) -> None:
        """Print the last line, JSON, if it is asked for."""
        if as_json:
            print(json.dumps({"benchmark": self._benchmark, **more, "results": self.rows}))
