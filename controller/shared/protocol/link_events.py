"""Events of a link for the host program, and the pause before a host reconnects."""

from dataclasses import dataclass
from typing import Final

from controller.shared.protocol.messages import UPDATE, VERSION, Message, Welcome

BACKOFF_S: Final = (0.25, 0.5, 1.0, 2.0)  # before the next attempts; the last one repeats
JITTER: Final = 0.25  # relative variation of a pause, so that many hosts do not connect at once


@dataclass(frozen=True, slots=True)
class Connected:
    """A session with a device has begun; every earlier one is over."""

    welcome: Welcome


@dataclass(frozen=True, slots=True)
class Delivered:
    """A message of the device; in order, each once."""

    message: Message  # Command, State, Telemetry, GroundTruth or Granted
    t_ms: int  # the device's time


@dataclass(frozen=True, slots=True)
class Stale:
    """No packet for 300 ms: release everything and pause. The next message ends this state."""


@dataclass(frozen=True, slots=True)
class Lost:
    """The connection is over: release everything. The next one begins with Connected."""

    reason: str


@dataclass(frozen=True, slots=True)
class Refused:
    """An attempt to connect failed, for a reason in one sentence; the next one follows."""

    reason: str


@dataclass(frozen=True, slots=True)
class Missed:
    """Number of commands that were lost or came too late; they will not be sent again."""

    count: int


Received = Connected | Delivered | Stale | Lost | Refused | Missed


def pause_s(failures: int, jitter: float) -> float:
    """Return the seconds before the next attempt.

    `failures` have failed since the last connection; `jitter` is a random number from 0 to 1.
    """
    return BACKOFF_S[min(failures, len(BACKOFF_S) - 1)] * (1.0 + JITTER * (2.0 * jitter - 1.0))


def no_answer(name: str, foreign: int, *, mute: bool) -> str:
    """Return the sentence after 2 s without Welcome.

    `foreign` is the peer's protocol version, if it is another than ours; `mute`: no byte came.
    """
    if foreign:
        command = UPDATE.format("host" if foreign > VERSION else "orb")
        return f"{name} has protocol version {foreign}, this host version {VERSION}; {command}"
    if not mute:
        return (
            f"{name} sends bytes, but not the OrbTouch protocol; "
            "name the orb's own port with --link"
        )
    return (
        f"opened {name}, but no OrbTouch answered within 2 s; switch the orb on, or name "
        "its own port with --link"
    )
