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

RESTLESS: Final = 0.9  # of the frames touched: the rest image has drifted away
REPEATED: Final = 0.01  # of the frames
UNLABELLED: Final = 0.5  # of the frames: less than half of it can be learnt from
EXCLUDED: Final = 0.5  # of the frames
LATE_REST_S: Final = 10.0  # the device takes one second of quiet


class Level(IntEnum):
    """How good; also the exit status that says so."""

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
        cadence: Timing of the frames; None where the file cannot be read.
        said: The labels of each source.
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
    rhythm = timing.measure(recording)
    said = labels.summarise(recording, response)
    found = taxels.examine(recording.frames, recording.origin.unit, response)
    useless = taxels.useless(found, response)
    unlabelled = np.all([getattr(recording, name) == UNKNOWN for name in LABELLERS], axis=0)
    shares = float(unlabelled.mean()), float(recording.excluded.mean())
    findings = [
        *_findings(rhythm.complaints(), rhythm.missing_share > timing.USELESS),
        # Neighbours can replace a taxel here and there, not so many.
        *_findings([one.text for one in found], useless.mean() > MOST),
        *_findings(line for one in said for line in one.complaints()),
        *_shares(*shares),
        *_findings(_copies(recording, response)),
        *_findings(_rest(recording, response)),
    ]
    if why := taxels.unjudged(response):
        findings.append(Finding(Level.GOOD, why))
    return Report(
        path,
        tuple(findings),
        float(recording.t[-1] - recording.t[0]),
        rhythm,
        said,
        tuple((int(row), int(column)) for row, column in np.argwhere(useless)),
        *shares,
    )


def twice(shared: Mapping[int, int], paths: list[Path]) -> list[Finding]:
    """Return the findings about a recording whose frames stand elsewhere as well.

    Args:
        shared: With which recordings, and how many frames.
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
    """Yield the problem that frames repeat themselves."""
    again = duplicates.repeated(recording, response.touched)
    if again > REPEATED * len(recording.t):
        yield f"{again} frames repeat the one before them, bit for bit"


def _rest(recording: Recording, response: Response) -> Iterator[str]:
    """Yield the problems that rest was never found, or was lost."""
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
