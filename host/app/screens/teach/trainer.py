"""Training of a bundle from recordings, by the commands of `models` in child processes."""

import json
import os
import queue
import re
import subprocess
import sys
import threading
import weakref
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from controller.shared.errors import reason
from controller.shared.files import read_text
from controller.shared.notices import notice, unpacked

COMMAND: Final = (sys.executable, "-m", "models")
NEEDED: Final = ("models", "torch", "onnx", "tomli_w", "matplotlib")
LEAST: Final = 2  # sessions; the newest is only judged
SHARES: Final = {"train": 0.62, "tune": 0.26, "evaluate": 0.12}  # of the time
_EPOCH: Final = re.compile(r"\bepoch (\d+)/(\d+)")
_MOST: Final = 16 << 20  # bytes of an evaluation
_NICE: Final = 10
_KNOWN: Final = 0.05  # progress before which no time left is known

Step = tuple[str, ...]  # words after `models`


@dataclass(frozen=True, slots=True)
class GestureResult:
    """How often a gesture of the spared session was understood."""

    label: str
    understood: int
    of: int
    why: str  # what became of the others, and what would help; "": nothing to say


def missing() -> list[str]:
    """Return the modules that training needs and that are not installed."""
    return [name for name in NEEDED if find_spec(name) is None]


def steps(sessions: Sequence[Path], out: Path, found: Path) -> list[Step]:
    """Return the commands that make a bundle `out` of sessions, oldest first, and judge it."""
    learned, spared, bundle = [str(path) for path in sessions[:-1]], str(sessions[-1]), str(out)
    return [
        ("train", *learned, "--task", "gesture", "--out", bundle),
        ("train", *learned, "--from", bundle, "--epochs", "0", "--out", bundle),
        ("evaluate", bundle, spared, "--json", str(found)),
    ]


def results(found: Path) -> list[GestureResult]:
    """Return the verdict of an evaluation, worst gesture first; ValueError if there is none."""
    try:
        sets = json.loads(read_text(found, _MOST))["results"]
        return [
            GestureResult(
                str(one["label"]),
                int(one["understood"]),
                int(one["of"]),
                _joined(unpacked(one["why"]), unpacked(one["advice"])),
            )
            for one in sets[0]["verdict"]
        ]
    except OSError as error:
        raise ValueError(notice("unreadable", found, reason(error))) from None
    except (KeyError, IndexError, TypeError, ValueError):
        raise ValueError(notice("no_evaluation", found)) from None


def _joined(why: str, advice: str) -> str:
    """Return both as one sentence, or the one that is not empty."""
    return notice("joined", why, advice) if why and advice else why or advice


class TrainingProgress:
    """Progress of the steps, from the lines that they print; pure."""

    def __init__(self, names: Sequence[str]) -> None:
        """Begin with the first of the steps, names of `SHARES`."""
        self._names, self._done, self._within = list(names), 0, 0.0

    def take(self, line: str) -> None:
        """Take a line of the present step; only counts of epochs matter."""
        if (match := _EPOCH.search(line)) and int(match[2]):
            self._within = min(1.0, int(match[1]) / int(match[2]))

    def next(self) -> None:
        """Begin the next step."""
        self._done, self._within = self._done + 1, 0.0

    @property
    def share(self) -> float:
        """Share of all steps that is done, 0 to 1."""
        lengths = [SHARES[name] for name in self._names]
        present = lengths[self._done] if self._done < len(lengths) else 0.0
        return min(1.0, (sum(lengths[: self._done]) + self._within * present) / sum(lengths))

    def left_s(self, passed_s: float) -> float | None:
        """Return the time left after so many seconds; None while it is not known."""
        share = self.share
        return passed_s * (1.0 - share) / share if share >= _KNOWN else None


class TrainingRun:
    """The steps, one process after the other; each ends with the program, or by `stop`.

    Attributes:
        progress: Of all steps.
        step: Name of the present step; "" at the end.
        problem: Why it failed, a sentence; "" if it did not.
    """

    def __init__(self, steps: Sequence[Step], command: Sequence[str] = COMMAND) -> None:
        self.progress = TrainingProgress([_name(step) for step in steps])
        self.problem = self.step = ""
        self._due: Iterator[Step] = iter(steps)
        self._command = command
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._last = ""  # line of the present step
        self._begin()

    def poll(self) -> None:
        """Take what was printed; begin the next step when one has ended."""
        ended = self.step and self._process.poll() is not None and not self._reader.is_alive()
        while not self._lines.empty():
            self._last = self._lines.get()
            self.progress.take(self._last)
        if not ended:
            return
        if self._process.returncode:
            words = self._last.removeprefix("models: ")
            self.problem = words or notice("trained_status", self._process.returncode)
            self.step = ""
        else:
            self.progress.next()
            self._end()
            self._begin()

    def stop(self) -> None:
        """End the present step, if there is one."""
        self.step = ""
        self._end()

    def _begin(self) -> None:
        words = next(self._due, ("",))
        self.step, self._last = _name(words), ""
        if not self.step:
            return
        self._process = subprocess.Popen(
            [*self._command, *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            creationflags=getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0),
        )
        if hasattr(os, "setpriority"):
            os.setpriority(os.PRIO_PROCESS, self._process.pid, _NICE)
        self._end = weakref.finalize(self, _kill, self._process)
        self._reader = threading.Thread(
            target=_read, args=(self._process, self._lines), daemon=True
        )
        self._reader.start()


def _name(step: Step) -> str:
    """Return a step's name, of `SHARES`; "" of none."""
    return "tune" if "--from" in step else step[0]


def _read(process: "subprocess.Popen[str]", lines: "queue.SimpleQueue[str]") -> None:
    assert process.stderr is not None
    with process.stderr as messages:
        for line in messages:
            lines.put(line.strip())


def _kill(process: "subprocess.Popen[str]") -> None:
    """End a process; its files are replaced as a whole, so none is left half written."""
    process.kill()
    process.wait()
