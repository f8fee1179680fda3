"""Quality check of a recording: all findings, and a verdict."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from enum import IntEnum
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.recordings.quality import duplicates, labels, taxels
from controller.recordings.quality import timing as cadence
from controller.recordings.quality.labels import SourceLabels
from controller.recordings.quality.response import respond
from controller.recordings.quality.timing import FrameTiming
from controller.recordings.recording import LABELLERS, PICOFARAD, UNKNOWN, Recording

# Neighbours can stand in for a taxel here and there, not for a fifth of the sensor.
LOST_TAXELS: Final = 0.2
RESTLESS: Final = 0.9  # of the frames touched: nobody plays so; rest has drifted away
REPEATED: Final = 0.01  # of the frames
UNLABELLED: Final = 0.5  # of the frames: less than half of it can be learnt from
EXCLUDED: Final = 0.5  # likewise
LATE_REST_S: Final = 10.0  # the device takes one second of quiet


class Level(IntEnum):
    """How good; also the exit status that says so."""

    GOOD = 0
    DOUBTFUL = 1
    FAILED = 2


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is not as it should be; at `GOOD`, one that is worth knowing."""

    level: Level
    text: str


@dataclass(frozen=True, slots=True)
class Report:
    """What is known about one file.

    Attributes:
        path: The file.
        findings: What is not as it should be.
        seconds: From its first frame to its last.
        cadence: How evenly frames came; None where it cannot be read.
        said: What each labeller said.
        useless: Taxels that are dead, stuck or loose, (row, column).
        unlabelled: Share of frames of which no labeller said anything.
        excluded: Share of frames that nobody shall learn from.
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
    """Return what is known about a recording, all by itself."""
    response = respond(recording)
    rhythm = cadence.measure(recording)
    said = labels.said(recording, response)
    mask, strange = taxels.strange(recording, response)
    nobody = np.all([getattr(recording, name) == UNKNOWN for name in LABELLERS], axis=0)
    shares = float(nobody.mean()), float(recording.excluded.mean())
    findings = [
        *_rhythm(rhythm),
        *_sensor(mask.mean(), strange),
        *(Finding(Level.DOUBTFUL, line) for one in said for line in one.complaints()),
        *_shares(*shares),
    ]
    again = duplicates.repeated(recording, response.touched)
    if again > REPEATED * len(recording.t):
        findings.append(
            Finding(Level.DOUBTFUL, f"{again} frames repeat the one before them, bit for bit")
        )
    findings += _rest(recording, response.known, response.touched)
    if why := taxels.unjudged(response):
        findings.append(Finding(Level.GOOD, why))
    return Report(
        path,
        tuple(findings),
        float(recording.t[-1] - recording.t[0]),
        rhythm,
        said,
        tuple((int(row), int(column)) for row, column in np.argwhere(mask)),
        *shares,
    )


def twice(shared: Mapping[int, int], paths: list[Path]) -> tuple[Finding, ...]:
    """Return what to say of a recording whose frames stand elsewhere as well.

    Args:
        shared: With which recordings, and how many frames.
        paths: Of the recordings, by number.
    """
    return tuple(
        Finding(
            Level.DOUBTFUL,
            f"{frames} of its frames are in {paths[other]} as well; learn from one of the two",
        )
        for other, frames in shared.items()
    )


def _rhythm(rhythm: FrameTiming) -> list[Finding]:
    lost = rhythm.missing_share > cadence.USELESS
    level = Level.FAILED if lost else Level.DOUBTFUL
    return [Finding(level, line) for line in rhythm.complaints()]


def _sensor(share: float, lines: list[str]) -> list[Finding]:
    level = Level.FAILED if share > LOST_TAXELS else Level.DOUBTFUL
    return [Finding(level, line) for line in lines]


def _shares(unlabelled: float, excluded: float) -> list[Finding]:
    findings = []
    if unlabelled > UNLABELLED:
        whole = "no frame is labelled" if unlabelled == 1.0 else (
            f"{100 * unlabelled:.0f} % of the frames are not labelled"
        )  # fmt: skip
        findings.append(
            Finding(Level.DOUBTFUL, f"{whole}; label them with: controller recordings relabel")
        )
    if excluded > EXCLUDED:
        level = Level.FAILED if excluded == 1.0 else Level.DOUBTFUL
        findings.append(Finding(level, f"{100 * excluded:.0f} % of the frames are excluded"))
    return findings


def _rest(recording: Recording, known: Any, touched: Any) -> list[Finding]:
    """Say where rest was never found, or was lost."""
    if recording.origin.unit != PICOFARAD or not known.any():
        return []
    findings = []
    late_s = float(recording.t[int(known.argmax())] - recording.t[0])
    if late_s > LATE_REST_S:
        findings.append(
            Finding(Level.DOUBTFUL, f"nobody kept still for a second in its first {late_s:.0f} s")
        )
    if touched[known].mean() > RESTLESS:
        findings.append(
            Finding(
                Level.DOUBTFUL,
                f"it deviates from rest in {100 * touched[known].mean():.0f} % of the frames; "
                "does the sensor drift or leak air?",
            )
        )
    return findings
