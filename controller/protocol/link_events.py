"""Events of a link for the program that uses it: connection, troubles, and the orb's messages.

And when a host that has lost its link tries again.
"""

from dataclasses import dataclass
from typing import Final

from controller.protocol.messages import VERSION, Message, Welcome

BACKOFF_S: Final = (0.25, 0.5, 1.0, 2.0)  # before the next attempt; the last one again and again
JITTER: Final = 0.25  # of a pause, more or less, so that many hosts do not knock in step


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
    """So many commands never came, or too late to be obeyed; they will not be sent again."""

    count: int


Received = Connected | Delivered | Stale | Lost | Refused | Missed


def pause_s(failures: int, jitter: float) -> float:
    """Return how long to wait before the next attempt.

    Args:
        failures: Attempts that failed since the last connection.
        jitter: A random number from 0 to 1.
    """
    return BACKOFF_S[min(failures, len(BACKOFF_S) - 1)] * (1.0 + JITTER * (2.0 * jitter - 1.0))


def no_answer(name: str, foreign: int, *, mute: bool) -> str:
    """Return the sentence for the user after 2 s without Welcome.

    Args:
        name: Of the link.
        foreign: Version of a peer that could not be understood; 0: none.
        mute: No byte came at all.
    """
    if foreign:
        side = "host" if foreign > VERSION else "orb's controller"
        return (
            f"{name} speaks protocol version {foreign}, this host version {VERSION}; "
            f"update the {side}"
        )
    if not mute:
        return (
            f"{name} says something, but not what an OrbTouch says; "
            "name the orb's own port with --link"
        )
    return (
        f"opened {name}, but no OrbTouch answered within 2 s; switch the orb on, or name "
        "its own port with --link"
    )
