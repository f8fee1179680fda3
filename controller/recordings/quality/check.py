"""Quality check of a recording: all findings, and a verdict."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from enum import IntEnum
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.recognition.dead_taxels import MOST
from controller.recordings.quality import duplicates, labels, taxels, timing
from controller.recordings.quality.labels import SourceLabels
from controller.recordings.quality.response import Response, respond
from controller.recordings.quality.timing import FrameTiming
from controller.recordings.recording import LABELLERS, PICOFARAD, UNKNOWN, Recording

RESTLESS: Final = 0.9  # share of touched frames that indicates a drifted baseline
REPEATED: Final = 0.01  # share of frames
UNLABELLED: Final = 0.5  # share of frames
EXCLUDED: Final = 0.5  # share of frames
LATE_REST_S: Final = 10.0  # the device needs one second without touch


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
    """Quality of one file.

    Attributes:
        path: The file.
        findings: All problems and notes.
        seconds: From its first frame to its last.
        cadence: Timing of the frames; None if the file cannot be read.
        said: Labels of each source.
        useless: Taxels that are dead, stuck or loose, (row, column).
        unlabelled: Share of frames without a label of any source.
        excluded: Share of frames that are left out of training.
    """

    path: Path
    findings: tuple[Finding, ...]
    seconds: float = 0.0
    cadence: FrameTiming | None = None
    said: tuple[SourceLabels, ...] = ()
    useless: tuple[tuple[int, int], ...] = ()
    unlabelled: float = 0.0
    excluded: float = 0.0

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
    cadence = timing.measure(recording)
    sources = labels.summarise(recording, response)
    found = taxels.examine(recording.frames, recording.origin.unit, response)
    useless = taxels.useless(found, response)
    unlabelled = np.all([getattr(recording, name) == UNKNOWN for name in LABELLERS], axis=0)
    shares = float(unlabelled.mean()), float(recording.excluded.mean())
    findings = [
        *_findings(cadence.complaints(), cadence.missing_share > timing.USELESS),
        # Only a small share of taxels can be interpolated from their neighbours.
        *_findings([one.text for one in found], useless.mean() > MOST),
        *_findings(line for one in sources for line in one.complaints()),
        *_shares(*shares),
        *_findings(_copies(recording, response)),
        *_findings(_rest(recording, response)),
    ]
    if note := taxels.unjudged(response):
        findings.append(Finding(Level.GOOD, note))
    return Report(
        path,
        tuple(findings),
        float(recording.t[-1] - recording.t[0]),
        cadence,
        sources,
        tuple((int(row), int(column)) for row, column in np.argwhere(useless)),
        *shares,
    )


def duplicated(shared: Mapping[int, int], paths: list[Path]) -> list[Finding]:
    """Return the findings about a recording with frames of others.

    Args:
        shared: Number of shared frames, by number of the other recording.
        paths: Of the recordings, by number.
    """
    return _findings(
        f"{frames} of its frames are in {paths[other]} as well; learn from one of the two"
        for other, frames in shared.items()
    )


def _findings(lines: Iterable[str], failed: bool = False) -> list[Finding]:
    return [Finding(Level.FAILED if failed else Level.DOUBTFUL, line) for line in lines]


def _shares(unlabelled: float, excluded: float) -> list[Finding]:
    findings = []
    if unlabelled > UNLABELLED:
        share = f"{100 * unlabelled:.0f} % of the frames are not labelled"
        share = "no frame is labelled" if unlabelled == 1.0 else share
        findings += _findings([f"{share}; label them with: controller recordings relabel"])
    if excluded > EXCLUDED:
        share = f"{100 * excluded:.0f} % of the frames are excluded"
        findings += _findings([share], failed=excluded == 1.0)
    return findings


def _copies(recording: Recording, response: Response) -> Iterator[str]:
    """Yield the problem of repeated frames."""
    again = duplicates.repeated(recording, response.touched)
    if again > REPEATED * len(recording.t):
        yield f"{again} frames repeat the one before them, bit for bit"


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
