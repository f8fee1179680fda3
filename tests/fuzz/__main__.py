"""Fuzz a reader for some minutes, and watch its memory.

    python -m tests.fuzz decoder|session|mapping [--minutes 10] [--json]

It needs atheris (pip install atheris). What makes a harness fail is kept in the folder that the
report names, and is run again with --input FILE. "growth" is what the process's memory gained in
its second half, when the corpus hardly grows any more; a leak shows there.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import json
import re
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from tests.support.processes import memory_mib

NAMES: Final = ("decoder", "session", "mapping")
LONGEST: Final = 4096  # bytes of an input
RSS_MIB: Final = 1024  # a process that takes more is stopped, and counts as failed
SLOW_S: Final = 10  # for one input
GROWTH_MIB: Final = 16.0  # in the second half: corpus and Python's own pools, no leak
_EVERY_S: Final = 1.0  # between two looks at the memory
_LINE: Final = re.compile(r"#(\d+)\s+\w+\s+cov: (\d+) ft: (\d+) corp: (\d+)")


def main(argv: list[str] | None = None) -> int:
    """Fuzz, print what was seen, and return 0 unless something failed or grew."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.fuzz", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("name", choices=NAMES)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--input", type=Path, metavar="FILE", help="run this one input, and stop")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(argv)
    if options.input is not None:
        importlib.import_module(f"tests.fuzz.{options.name}").one(options.input.read_bytes())
        return 0
    if importlib.util.find_spec("atheris") is None:
        parser.error("atheris is missing; pip install atheris")
    place = Path(tempfile.mkdtemp(prefix=f"fuzz-{options.name}-"))
    report = fuzz(options.name, options.minutes * 60, place)
    for key, value in report.items():
        print(f"{key:12} {value}")
    if options.json:
        print(json.dumps({"fuzz": options.name, **report}))
    return 0 if report["status"] == 0 and report["growth_mib"] <= GROWTH_MIB else 1


def fuzz(name: str, seconds: float, place: Path) -> dict[str, Any]:
    """Run a harness for some time; return what it did, and what became of its memory."""
    corpus, failures = place / "corpus", place / "failures"
    corpus.mkdir()
    failures.mkdir()
    harness = importlib.import_module(f"tests.fuzz.{name}")
    for number, seed in enumerate(harness.seeds()):
        (corpus / f"seed-{number}").write_bytes(seed)
    words = place / "words"
    words.write_text("".join(f'"{_escaped(word)}"\n' for word in harness.DICTIONARY))
    dictionary = [f"-dict={words}"] if harness.DICTIONARY else []  # libFuzzer takes no empty one
    command = [
        *(sys.executable, "-m", "tests.fuzz.under_atheris", name, str(corpus)),
        *(f"-max_total_time={seconds:.0f}", f"-max_len={LONGEST}", f"-timeout={SLOW_S}"),
        *(f"-rss_limit_mb={RSS_MIB}", f"-artifact_prefix={failures}/"),
        *dictionary,
        "-print_final_stats=1",
    ]
    log = place / "log.txt"
    with log.open("wb") as messages:
        process = subprocess.Popen(command, stdout=messages, stderr=messages)
        memory = _watch(process)
    told = log.read_text(errors="replace")
    lines = [[int(number) for number in found] for found in _LINE.findall(told)]
    runs, edges, features, kept = lines[-1] if lines else (0, 0, 0, 0)
    stat = re.search(r"stat::number_of_executed_units:\s*(\d+)", told)
    middle = memory[len(memory) // 2] if memory else 0.0
    return {
        "status": process.returncode,
        "seconds": round(seconds),
        "executions": int(stat[1]) if stat else runs,
        "edges": edges,
        "features": features,
        "corpus": kept,
        "rss_mib": [round(value, 1) for value in memory[:: max(len(memory) // 10, 1)]],
        "growth_mib": round(memory[-1] - middle, 1) if memory else 0.0,
        "failures": sorted(str(path) for path in failures.iterdir()),
        "log": str(log),
    }


def _watch(process: subprocess.Popen[bytes]) -> list[float]:
    """Return the memory of a process, MiB, second by second until it ends."""
    memory = []
    while process.poll() is None:
        with suppress(OSError, LookupError):  # it has just ended, or this is no Linux
            memory.append(memory_mib(pid=process.pid))
        time.sleep(_EVERY_S)
    return memory


def _escaped(word: bytes) -> str:
    return "".join(f"\\x{byte:02x}" for byte in word)


if __name__ == "__main__":
    sys.exit(main())
