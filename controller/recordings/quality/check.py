"""Quality check of a recording: all findings, and a verdict; frames that recordings share."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.recordings.quality import labels, taxels
from controller.recordings.quality.labels import FrameTiming, SourceLabels
from controller.recordings.quality.taxels import Response, respond
from controller.recordings.recording import LABELLERS, PICOFARAD, UNKNOWN, Recording
from controller.shared import blocks, taxel_measures

RESTLESS: Final = 0.9  # share of touched frames that indicates a drifted baseline
REPEATED: Final = 0.01  # share of frames
UNLABELLED: Final = 0.5  # share of frames
EXCLUDED: Final = 0.5  # share of frames
LATE_REST_S: Final = 10.0  # the device needs one second without touch
RUN: Final = 10  # consecutive frames; equal runs of this length are copies
_MIX: Final = 0x9E3779B97F4A7C15  # odd: hashes of a run count by their place


class Level(IntEnum):
    """Quality level; its value is the exit status."""

    GOOD = 0
    DOUBTFUL = 1
    FAILED = 2


@dataclass(frozen=True, slots=True)
class Finding:
    """A problem; at `GOOD`, a note."""

    level: Level
    text: str


@dataclass(frozen=True, slots=True)
class Report:
    """Quality of one file."""

    path: Path
    findings: tuple[Finding, ...]
    seconds: float = 0.0  # from its first frame to its last, without pauses
    cadence: FrameTiming | None = None  # None if the file cannot be read
    said: tuple[SourceLabels, ...] = ()

    @property
    def level(self) -> Level:
        """The verdict: that of the worst finding."""
        return max((finding.level for finding in self.findings), default=Level.GOOD)

    def also(self, *findings: Finding) -> "Report":
        """Return the report with more findings."""
        return replace(self, findings=(*self.findings, *findings))


def examine(path: Path, recording: Recording) -> Report:
    """Return the quality of one recording."""
    response = respond(recording)
    cadence = labels.measure(recording)
    sources = labels.summarise(recording, response)
    found = taxels.examine(recording.frames, recording.origin.unit, response)
    # Taxels that read nothing; a dead one is a guess from its neighbours, and fails no recording.
    silent = (one for one in found if one.kind != "dead")
    blind = taxel_measures.useless(silent, recording.frames.shape[1:])
    findings = [
        *_findings(cadence.complaints(), cadence.missing_share > labels.USELESS),
        # Only a small share of taxels can be interpolated from their neighbours.
        *_findings(
            (f"{taxel_measures.taxel_names(one.mask)}: {one.text}" for one in found),
            blind.mean() > taxel_measures.DEAD_TAXELS_SHARE,
        ),
        *_findings(line for one in sources for line in one.complaints()),
        *_shares(recording),
        *_findings(_copies(recording, response)),
        *_findings(_rest(recording, response)),
    ]
    if note := taxels.unjudged(response):
        findings.append(Finding(Level.GOOD, note))
    return Report(
        path,
        tuple(findings),
        float(np.diff(recording.t)[~labels.pauses(recording)[1:]].sum()),
        cadence,
        sources,
    )


@dataclass
class FrameIndex:
    """Index of the runs of frames in a set of recordings."""

    _runs: list[NDArray[np.uint64]] = field(default_factory=list)  # each once, by recording

    def add(self, recording: Recording) -> None:
        """Add the next recording; they are numbered from 0."""
        frames, count = recording.frames, max(0, len(recording.frames) - RUN + 1)
        hashes = np.empty(len(frames), dtype=np.int64)
        for part in blocks.blocks(frames):
            hashes[part] = [hash(frame.tobytes()) for frame in frames[part]]
        runs, moves = np.zeros(count, dtype=np.uint64), np.zeros(count, dtype=np.bool_)
        for i in range(RUN):
            own = hashes[i : i + count]
            moves |= own != hashes[:count]
            runs *= np.uint64(_MIX)  # modulo 2**64
            runs += own.view(np.uint64)
        self._runs.append(np.unique(runs[moves]))

    def shared(self) -> dict[int, dict[int, int]]:
        """Return the approximate numbers of shared frames, by pairs of recordings.

        Each run counts for the first recording that has it and each other one.
        """
        found: dict[int, dict[int, int]] = defaultdict(dict)
        if len(self._runs) < 2:
            return {}
        owners = np.repeat(np.arange(len(self._runs)), [len(runs) for runs in self._runs])
        runs = np.concatenate(self._runs)
        order = np.argsort(runs, kind="stable")
        runs, owners = runs[order], owners[order]
        begins = np.flatnonzero(np.diff(runs, prepend=~runs[:1]) != 0)
        first = np.repeat(owners[begins], np.diff(begins, append=len(runs)))
        pairs = np.stack([first, owners], axis=1)[first != owners]
        for (a, b), count in zip(*np.unique(pairs, axis=0, return_counts=True), strict=True):
            found[int(a)][int(b)] = found[int(b)][int(a)] = int(count) + RUN - 1
        return dict(found)


def duplicated(shared: Mapping[int, int], paths: list[Path]) -> list[Finding]:
    """Return findings on frames shared with other recordings, by their numbers in `paths`."""
    return _findings(
        f"{frames} of its frames are in {paths[other]} as well; learn from one of the two"
        for other, frames in shared.items()
    )


def _findings(lines: Iterable[str], failed: bool = False) -> list[Finding]:
    return [Finding(Level.FAILED if failed else Level.DOUBTFUL, line) for line in lines]


def _shares(recording: Recording) -> Iterator[Finding]:
    """Yield the findings on unlabelled and on excluded frames."""
    unlabelled = np.all([getattr(recording, name) == UNKNOWN for name in LABELLERS], axis=0).mean()
    if unlabelled > UNLABELLED:
        text = f"{100 * unlabelled:.0f} % of the frames are not labelled; label them with: "
        yield Finding(Level.DOUBTFUL, f"{text}orbtouch.Recording.relabel")
    excluded = recording.excluded.mean()
    if excluded > EXCLUDED:
        level = Level.FAILED if excluded == 1.0 else Level.DOUBTFUL
        yield Finding(level, f"{100 * excluded:.0f} % of the frames are excluded")


def _copies(recording: Recording, response: Response) -> Iterator[str]:
    """Yield the problem of touched frames equal to the one before; at rest, counts may repeat."""
    frames, repeated = recording.frames, 0
    for part in blocks.blocks(frames, before=1):
        some = frames[part]
        same = (some[1:] == some[:-1]).all(axis=(1, 2)) & response.touched[part][1:]
        repeated += int(same.sum())
    if repeated > REPEATED * len(frames):
        yield f"{repeated} frames repeat the one before them, bit for bit"


def _rest(recording: Recording, response: Response) -> Iterator[str]:
    """Yield the problems of a late or lost baseline."""
    known = response.known
    if recording.origin.unit != PICOFARAD or not known.any():
        return
    late_s = float(recording.t[int(known.argmax())] - recording.t[0])
    if late_s > LATE_REST_S:
        yield f"the sensor was not untouched for a second in its first {late_s:.0f} s"
    share = response.touched[known].mean()
    if share > RESTLESS:
        yield (
            f"it deviates from rest in {100 * share:.0f} % of the frames; "
            "does the sensor drift or leak air?"
        )
