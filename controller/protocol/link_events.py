"""Events of a link for the program that uses it: connection, troubles, and the orb's messages."""

from __future__ import annotations

from dataclasses import dataclass

from controller.protocol.messages import Message, Welcome


@dataclass(frozen=True, slots=True)
class Connected:
    """A device has welcomed us; everything before is over."""

    welcome: Welcome


@dataclass(frozen=True, slots=True)
class Delivered:
    """A message of the device, in order, each once."""

    message: Message  # Command, State, Telemetry, GroundTruth or Granted
    t_ms: int  # the device's time


@dataclass(frozen=True, slots=True)
class Stale:
    """Nothing has come for 300 ms: release everything and pause. The next message revives."""


@dataclass(frozen=True, slots=True)
class Lost:
    """The connection is over: release everything. The next one begins with Connected."""

    reason: str


@dataclass(frozen=True, slots=True)
class Refused:
    """There is no connection, and this is why, in one sentence; we keep trying."""

    reason: str


@dataclass(frozen=True, slots=True)
class Missed:
    """So many commands never came, or too late to be obeyed; nobody will send them again."""

    count: int


Received = Connected | Delivered | Stale | Lost | Refused | Missed
