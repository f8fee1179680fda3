"""Checked parts of a run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import Recognizer
from controller.links import PRINT, Link
from controller.recognition.mapping import Mapping
from controller.runtime.process import IdleCollector
from controller.sensors.base import Sensor

if TYPE_CHECKING:
    from controller.capture.session_recorder import RunFiles


@dataclass(frozen=True, slots=True)
class RunOptions:
    """Options of a plain run, as `controller --help` describes them."""

    sensor: str = "virtual"
    seed: int = 1
    preset: str = "nominal"
    fault: tuple[str, ...] = ()
    bundle: Path | None = None
    mapping: Path | None = None
    link: str = PRINT
    key: Path | None = None
    unprotected: bool = False
    record: Path | None = None
    user: str = ""
    session: str = "1"
    label: str = ""
    replay: Path | None = None
    rate: float | None = None


@dataclass(frozen=True, slots=True)
class Parts:
    """Checked parts of a run."""

    options: RunOptions  # of the command line
    bundle: Bundle  # the one in use
    recognizer: Recognizer  # its networks
    mapping: Mapping  # its mapping, or an override of it
    sensor: Sensor  # the sensor of the first session, before its first frame
    link: Link  # the link for messages
    owned: bool  # whether a host started this process
    runs: RunFiles | None  # files for recordings; None: no recording
    collector: IdleCollector | None = None  # garbage collection between frames; None: Python's own
