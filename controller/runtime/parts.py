"""Checked parts of a run."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import dataclass
from typing import TYPE_CHECKING

from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import Recognizer
from controller.links import Link
from controller.recognition.mapping import Mapping
from controller.runtime.process import IdleCollector
from controller.sensors.base import Sensor

if TYPE_CHECKING:
    from controller.capture.cues import CuePlan
    from controller.capture.session_recorder import RunFiles


@dataclass(frozen=True, slots=True)
class Parts:
    """Checked parts of a run."""

    options: Namespace  # of the command line
    bundle: Bundle  # the one in use
    recognizer: Recognizer  # its networks
    mapping: Mapping  # its mapping, or an override of it
    sensor: Sensor  # the sensor of the first session, before its first frame
    link: Link  # the link for messages
    owned: bool  # whether a host started this process
    runs: RunFiles | None  # files for recordings; None: no recording
    plan: CuePlan | None  # cues of a recording; None: without cues
    collector: IdleCollector | None = None  # garbage collection between frames; None: Python's own
