"""Cost of crashes: recordings killed, cut, bit-flipped and half lost, then recovered.

    python -m tests.benchmarks.crash [--kills N] [--damages N] [--seed N] [--json]

Real processes record seeded frames at 100 Hz, or run `controller --record` at 10 Hz, and get
SIGKILL at a random moment: while they record, seal or recover. Copies of the journals that they
leave are then damaged. Whatever is left is recovered, and every frame compared with what its seed
and number make. Seconds lost are those between the last frame that the process had handed over, or
that the file held before the damage, and the last one recovered. Needs fork: Linux or macOS.
"""

from __future__ import annotations

import shutil
import signal
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from controller.recognition.images.frames import Frame
from controller.recordings import journal as records
from controller.recordings import journal_file, reader
from controller.recordings.journal import Kind
from controller.recordings.recorder import SYNC_S
from controller.recordings.recording import Recording, RecordingError

from .crash_lives import LABELS, ORIGIN, RATE_HZ, Life, control, kill, made, record, recover, seal
from .results import Results, Row, command_line, row

GOAL_S: Final = 1.0  # "at most the last second is lost"
LIFE_S: Final = 3.0  # the longest that a process lives
CONTROLLER_S: Final = 6.0  # likewise; it takes a second or two to start
CONTROLLER_HZ: Final = 10.0

Expected = Callable[[int], Frame | None]  # the frame of a number; None: nobody knows


@dataclass
class Tally:
    """What became of all runs of one kind."""

    name: str
    runs: int = 0
    recovered: int = 0
    frames: int = 0
    wrong: int = 0
    unknown: int = 0  # frames that nobody can tell the right one of
    lost_s: list[float] = field(default_factory=list)
    reasons: Counter[str] = field(default_factory=Counter)

    def take(self, folder: Path, expected: Expected, last: int, rate_hz: float = RATE_HZ) -> None:
        """Recover a folder and judge it; `last` is the number of the last frame there was."""
        self.runs += 1
        reason = "no frame had reached the journal yet"
        for journal in journal_file.leftovers(folder):
            try:
                journal_file.recover(journal)
            except RecordingError as error:
                reason = str(error).removeprefix(f"the journal {journal} ")
        found = 0
        for path in folder.glob("[!.]*.npz"):
            recording = reader.load(path)
            self.recovered += 1
            found = max(found, int(recording.sequence[-1]))
            self._compare(recording, expected)
        self.lost_s.append(max(0, last - found) / rate_hz)
        if not found:
            self.reasons[reason] += 1

    def _compare(self, recording: Recording, expected: Expected) -> None:
        rows = zip(recording.sequence.tolist(), recording.t.tolist(), recording.frames, strict=True)
        for number, t_s, frame in rows:
            right = expected(number)
            self.frames += 1
            if right is None:
                self.unknown += 1
            elif frame.tobytes() != right.tobytes() or t_s != number / recording.origin.rate_hz:
                self.wrong += 1
        if recording.origin.device_id == ORIGIN.device_id:
            self.wrong += int((recording.label != recording.sequence % len(LABELS)).sum())


def recordings(count: int, work: Path, rng: np.random.Generator) -> tuple[Tally, list[Left]]:
    """Kill processes that record; return the journals of those that had some time."""
    tally = Tally("killed while recording")
    journals: list[Left] = []
    lives = [Life(room(work), k, rng.uniform(0.02, LIFE_S)) for k in range(count)]
    kill(lives, record)
    for life in lives:
        if life.added.value >= RATE_HZ:
            [journal] = journal_file.leftovers(life.folder)
            journals.append(left(life.seed, journal.read_bytes()))
        tally.take(life.folder, partial(made, life.seed), life.added.value)
    return tally, journals


def sealings(count: int, work: Path, rng: np.random.Generator) -> Tally:
    """Kill processes while they seal a session of which everything is on the disk."""
    tally = Tally("killed while sealing")
    lives = [Life(room(work), k, rng.uniform(0.0, 0.1), waits=True) for k in range(count)]
    kill(lives, seal)
    for life in lives:
        tally.take(life.folder, partial(made, life.seed), life.added.value)
    return tally


def recoveries(count: int, work: Path, rng: np.random.Generator, journals: list[Left]) -> Tally:
    """Kill processes while they recover."""
    tally = Tally("killed while recovering")
    for k in range(count):
        journal = journals[k % len(journals)]
        life = Life(room(work), journal.seed, rng.uniform(0.0, 0.03), waits=True)
        (life.folder / "one.journal").write_bytes(journal.data)
        kill([life], recover)
        tally.take(life.folder, partial(made, journal.seed), journal.last(len(journal.data)))
    return tally


def controllers(count: int, work: Path, rng: np.random.Generator) -> Tally:
    """Kill `controller`; its frames are compared with those of a run that nobody killed."""
    tally = Tally("controller killed")
    whole = Life(room(work), 7, 2 * CONTROLLER_S)
    kill([whole], control, signal.SIGTERM)
    recording = reader.load(whole.folder / "one.npz")
    # What is read after a missed frame depends on the time, so nobody can tell what is right.
    known = int(np.cumprod(recording.sequence == np.arange(1, len(recording.t) + 1)).sum())
    lives = [Life(room(work), 7, rng.uniform(1.0, CONTROLLER_S)) for _ in range(count)]
    kill(lives, control)
    for life in lives:
        tally.take(
            life.folder,
            lambda number: recording.frames[number - 1] if number <= known else None,
            life.added.value,
            CONTROLLER_HZ,
        )
    return tally


def room(work: Path) -> Path:
    return Path(tempfile.mkdtemp(dir=work))


def damaged(
    name: str, count: int, work: Path, rng: np.random.Generator, journals: list[Left]
) -> Tally:
    """Damage journals in one way."""
    tally = Tally(name)
    for _ in range(count):
        journal = journals[int(rng.integers(len(journals)))]
        other = journals[int(rng.integers(len(journals)))]
        content, until = DAMAGES[name](journal, rng, other.data if other != journal else b"\0")
        folder = room(work)
        (folder / "one.journal").write_bytes(content)
        tally.take(folder, partial(made, journal.seed), journal.last(until))
        shutil.rmtree(folder)
    return tally


BLOCK: Final = 4096  # bytes; a disk loses or keeps a block in one piece


@dataclass(frozen=True)
class Left:
    """A journal that a killed process left, and how it stood before the last sync."""

    seed: int  # of its frames
    data: bytes  # all of it
    frames: tuple[tuple[int, int], ...]  # (number, end) of each frame
    confirmed: int  # all before this offset was on the disk then; the rest was being synced

    def last(self, cut: int) -> int:
        """Return the number of the last frame that is whole before an offset."""
        return max((number for number, end in self.frames if end <= cut), default=0)


def left(seed: int, data: bytes) -> Left:
    """Return a journal that nothing has damaged; its last sync took what came in `SYNC_S`."""
    ends = [end for kind, _, end in records._records(data) if kind == Kind.FRAME]
    return Left(seed, data, tuple(enumerate(ends, 1)), ends[-round(SYNC_S * RATE_HZ) - 1])


Damage = Callable[[Left, np.random.Generator, bytes], tuple[bytes, int]]  # content, whole until


def cut(journal: Left, rng: np.random.Generator, other: bytes) -> tuple[bytes, int]:
    place = int(rng.integers(len(journal.data)))
    return journal.data[:place], place


def flip(journal: Left, rng: np.random.Generator, other: bytes) -> tuple[bytes, int]:
    """Flip a few bits anywhere; what follows the first of them is not read."""
    content = bytearray(journal.data)
    places = rng.integers(len(content), size=rng.integers(1, 9)).tolist()
    for place in places:
        content[place] ^= 1 << int(rng.integers(8))
    return bytes(content), min(places)


def truncate(journal: Left, rng: np.random.Generator, other: bytes) -> tuple[bytes, int]:
    """Cut at the last offset that was confirmed."""
    return journal.data[: journal.confirmed], len(journal.data)


def lose(journal: Left, rng: np.random.Generator, other: bytes) -> tuple[bytes, int]:
    """Lose some of the blocks that were not confirmed."""
    return _blocks(journal, lambda k, block: block if rng.random() < 0.5 else bytes(len(block)))


def stale(journal: Left, rng: np.random.Generator, other: bytes) -> tuple[bytes, int]:
    """See what another journal left in some of the blocks that were not confirmed."""
    old = other * (len(journal.data) // len(other) + 1)
    return _blocks(
        journal, lambda k, block: block if rng.random() < 0.5 else old[k : k + len(block)]
    )


def reorder(journal: Left, rng: np.random.Generator, other: bytes) -> tuple[bytes, int]:
    """See the blocks that were not confirmed in another order."""
    start = -(-journal.confirmed // BLOCK) * BLOCK  # the one before is confirmed in part
    data = journal.data
    tail = [data[k : k + BLOCK] for k in range(start, len(data), BLOCK)]
    return data[:start] + b"".join(tail[k] for k in rng.permutation(len(tail))), len(data)


def _blocks(journal: Left, become: Callable[[int, bytes], bytes]) -> tuple[bytes, int]:
    """Return a journal whose unconfirmed blocks have become something else."""
    data = journal.data
    content = data[: journal.confirmed]
    while len(content) < len(data):
        start = len(content)
        content += become(start, data[start : start // BLOCK * BLOCK + BLOCK])
    return content, len(data)


DAMAGES: Final[dict[str, Damage]] = {
    "cut anywhere": cut,
    "bits flipped": flip,
    "cut where synced": truncate,
    "unsynced blocks missing": lose,
    "unsynced blocks stale": stale,
    "unsynced blocks reordered": reorder,
}


def main() -> None:
    arguments = command_line(__doc__, kills=200, damages=100, seed=1).parse_args()
    rng = np.random.default_rng(arguments.seed)
    tenth = max(1, arguments.kills // 10)
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        tally, journals = recordings(arguments.kills - 3 * tenth, work, rng)
        tallies = [tally, sealings(tenth, work, rng), recoveries(tenth, work, rng, journals)]
        tallies.append(controllers(tenth, work, rng))
        tallies += [damaged(name, arguments.damages, work, rng, journals) for name in DAMAGES]
    show(tallies)
    results = Results("crash")
    results.rows = [result(tally) for tally in tallies]
    results.finish(arguments.json)


def show(tallies: list[Tally]) -> None:
    """Print a line for each kind, and each reason for a refusal."""
    print(
        f"{'':26}{'runs':>5}{'recovered':>11}{'frames':>9}{'wrong':>7}{'lost, s: median, most':>24}"
    )
    for t in tallies:
        lost = f"{np.median(t.lost_s):.2f} {max(t.lost_s):9.2f}"
        print(f"{t.name:26}{t.runs:5}{t.recovered:11}{t.frames:9}{t.wrong:7}{lost:>24}")
        for reason, times in t.reasons.most_common():
            print(f"    {times} without a recording: {reason}")
    worst = max(max(t.lost_s) for t in tallies)
    wrong = sum(t.wrong for t in tallies)
    print(f"worst: {worst:.2f} s lost (at most {GOAL_S:g}), {wrong} wrong frames (none)")


def result(tally: Tally) -> Row:
    """Return what a kind gave, as a result."""
    return row(
        tally.name, max(tally.lost_s), "s", goal=GOAL_S, runs=tally.runs,
        recovered=tally.recovered, frames=tally.frames, wrong=tally.wrong,
        uncompared=tally.unknown, reasons=dict(tally.reasons),
    )  # fmt: skip


if __name__ == "__main__":
    main()
