"""Quality check of a recording: all findings, and a verdict; frames that recordings share."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from enum import IntEnum
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.recordings.quality import labels, taxels
from controller.recordings.quality.labels import FrameTiming, SourceLabels
from controller.recordings.quality.taxels import Response, respond
from controller.recordings.recording import LABELLERS, PICOFARAD, UNKNOWN, Recording
from controller.shared import taxel_measures

RESTLESS: Final = 0.9  # share of touched frames that indicates a drifted baseline
REPEATED: Final = 0.01  # share of frames
UNLABELLED: Final = 0.5  # share of frames
EXCLUDED: Final = 0.5  # share of frames
LATE_REST_S: Final = 10.0  # the device needs one second without touch
RUN: Final = 10  # consecutive frames; equal runs of this length are copies


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
    useless: tuple[tuple[int, int], ...] = ()  # taxels, (row, column)

    @property
    def level(self) -> Level:
        """The verdict: that of the worst finding."""
        return max((finding.level for finding in self.findings), default=Level.GOOD)

    def also(self, *findings: Finding) -> "Report":
        """Return the report with more findings."""
        return replace(self, findings=(*self.findings, *findings))

    def plain(self) -> dict[str, Any]:
        """Return the report as plain data."""
        return {
            **asdict(self),
            "path": str(self.path),
            "verdict": self.level.name.lower(),
            "findings": [
                {"level": finding.level.name.lower(), "text": finding.text}
                for finding in self.findings
            ],
        }


def examine(path: Path, recording: Recording) -> Report:
    """Return the quality of one recording."""
    response = respond(recording)
    cadence = labels.measure(recording)
    sources = labels.summarise(recording, response)
    found = taxels.examine(recording.frames, recording.origin.unit, response)
    useless = taxel_measures.useless(found, recording.frames.shape[1:])
    findings = [
        *_findings(cadence.complaints(), cadence.missing_share > labels.USELESS),
        # Only a small share of taxels can be interpolated from their neighbours.
        *_findings(
            (f"{taxel_measures.taxel_names(one.mask)}: {one.text}" for one in found),
            useless.mean() > taxel_measures.DEAD_TAXELS_SHARE,
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
        tuple((int(row), int(column)) for row, column in np.argwhere(useless)),
    )


@dataclass
class FrameIndex:
    """Index of the runs of frames in a set of recordings."""

    _count: int = 0
    _first: dict[int, int] = field(default_factory=dict)  # run, the first recording that has it
    _pairs: Counter[tuple[int, int]] = field(default_factory=Counter)  # runs that two share

    def add(self, recording: Recording) -> None:
        """Add the next recording; they are numbered from 0."""
        hashes = [hash(frame.tobytes()) for frame in recording.frames]
        runs = (tuple(hashes[i : i + RUN]) for i in range(len(hashes) - RUN + 1))
        for run in {hash(run) for run in runs if len(set(run)) > 1}:
            first = self._first.setdefault(run, self._count)
            if first != self._count:
                self._pairs[first, self._count] += 1
        self._count += 1

    def shared(self) -> dict[int, dict[int, int]]:
        """Return the approximate numbers of shared frames, by pairs of recordings."""
        found: dict[int, dict[int, int]] = defaultdict(dict)
        for (a, b), runs in sorted(self._pairs.items()):
            found[a][b] = found[b][a] = runs + RUN - 1
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
    frames: NDArray[np.float32] = recording.frames
    same = (frames[1:] == frames[:-1]).all(axis=(1, 2)) & response.touched[1:]
    if same.sum() > REPEATED * len(frames):
        yield f"{same.sum()} frames repeat the one before them, bit for bit"


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
