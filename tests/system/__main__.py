"""Run the cases in a virtual machine and print what they found: python -m tests.system [CASE ...].

It needs qemu, mmdebstrap and squashfs-tools, on Linux on x86-64. The first run builds the image,
which takes some minutes more.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from . import vm
from .image import DEFAULT, SUITES, ImageError


def main(argv: list[str] | None = None) -> int:
    """Return 0 if every case went well, 1 if not, 2 if there is no machine to run them in."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.system",
        description="Play over real BlueZ and a real kernel, between two linked virtual adapters.",
    )
    parser.add_argument("cases", nargs="*", help=f"default: all, {', '.join(vm.names())}")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="keep every log here")
    parser.add_argument(
        "--debian", choices=tuple(SUITES), default=DEFAULT, help="release (default: %(default)s)"
    )
    options = parser.parse_args(argv)
    unknown = set(options.cases) - set(vm.names())
    if unknown:
        parser.error(f"there is no case {sorted(unknown)[0]}; there are {', '.join(vm.names())}")
    start_s = time.monotonic()
    try:
        results = vm.run(options.cases or vm.names(), options.keep, options.debian)
    except ImageError as error:
        print(f"tests.system: {error}", file=sys.stderr)
        return 2
    print(table(results))
    failed = [result for result in results.values() if not result.ok]
    for result in failed:
        print(f"\n--- {result.name} ---\n{result.log[-6000:]}", file=sys.stderr)
    seconds = time.monotonic() - start_s
    print(f"\n{len(results) - len(failed)} passed, {len(failed)} failed, in {seconds:.0f} s")
    return 1 if failed else 0


def table(results: dict[str, vm.Result]) -> str:
    """Return what was found and measured, as Markdown that docs/bluetooth.md quotes."""
    lines = ["| case | | s | what was seen |", "|---|---|---|---|"]
    for result in results.values():
        mark = "ok" if result.ok else "FAILED"
        seen = "; ".join(result.found)
        lines.append(f"| {result.name} | {mark} | {result.seconds:.0f} | {seen} |")
    lines += ["", "| latency | n | p50 ms | p99 ms |", "|---|---|---|---|"]
    for result in results.values():
        for row in result.rows:
            lines.append("| {what} | {n} | {p50_ms:.2f} | {p99_ms:.2f} |".format(**row))
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
