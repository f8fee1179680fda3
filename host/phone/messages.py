"""Messages between the phone's page and the program: fingers in, a view out; pure.

The page sends JSON texts: first a string, the key of an earlier connection or "", and then
lists of fingers, each [number, x, y, radius, pressure].
"""

import json
import math
from dataclasses import asdict, dataclass, field
from typing import Any, Final, NoReturn

MAX_FINGERS: Final = 10
MAX_BYTES: Final = 1024  # of a message from the page; ten fingers take 400
MAX_KEY: Final = 64  # letters
RATE_HZ: Final = 150.0  # messages of one page; it sends one per picture, at most 120
BURST: Final = 150  # messages that may come at once, after a pause


class PhoneMessageError(ValueError):
    """A message is malformed; the message says how."""


@dataclass(frozen=True, slots=True)
class Finger:
    """One finger on the dome.

    Lengths are in radii of the dome, from its centre: x to the right, y up.
    """

    number: int  # 0 to 9, unique among those on the dome
    x: float
    y: float
    radius: float  # of its contact area, 0 to 1; 0: unknown
    pressure: float  # 0 to 1; 0.5: unknown


@dataclass(frozen=True, slots=True)
class Zone:
    """A rectangle of the dome with the command of a press there; the first that fits counts.

    Lengths are as in Finger.
    """

    left: float
    right: float
    bottom: float
    top: float
    command: str  # its name, written at `at`
    at: tuple[float, float]


@dataclass(frozen=True, slots=True)
class View:
    """The page's content, in the language of the window."""

    words: dict[str, str] = field(default_factory=dict)  # that the page shows without a connection
    status: str = ""  # of orb and connection, a sentence
    last: str = ""  # the last command, or the reason that there was none
    commanded_s: float = 0.0  # when the last command came: the phone vibrates as it changes
    zones: tuple[Zone, ...] = ()

    def json(self, **further: str) -> str:
        """Return it as a JSON object, with further members."""
        return json.dumps({**asdict(self), **further}, separators=(",", ":"))


class RateLimit:
    """A token bucket: `burst` messages at once, `rate_hz` in the long run."""

    def __init__(self, rate_hz: float, burst: int) -> None:
        """Begin with a full bucket."""
        self._rate_hz, self._burst = rate_hz, burst
        self._left, self._last_s = float(burst), -math.inf

    def take(self, now_s: float) -> bool:
        """Count a message; return whether it is within the rate."""
        grown = self._left + (now_s - self._last_s) * self._rate_hz
        self._left, self._last_s = min(self._burst, grown) - 1.0, now_s
        return self._left >= 0.0


def key(text: str | bytes) -> str:
    """Return the key of a first message, "" for none; PhoneMessageError if it is none."""
    value = _value(text)
    if not isinstance(value, str) or len(value) > MAX_KEY:
        raise PhoneMessageError("the first message must be a key")
    return value


def fingers(text: str | bytes) -> tuple[Finger, ...]:
    """Return the fingers of a message; PhoneMessageError unless all are on the dome."""
    value = _value(text)
    if not isinstance(value, list) or len(value) > MAX_FINGERS:
        raise PhoneMessageError(f"a message must be a list of at most {MAX_FINGERS} fingers")
    found = tuple(_finger(one) for one in value)
    if len({finger.number for finger in found}) < len(found):
        raise PhoneMessageError("two fingers have one number")
    return found


def _finger(value: Any) -> Finger:
    if not isinstance(value, list) or len(value) != 5:
        raise PhoneMessageError("a finger must be five numbers")
    number, x, y, radius, pressure = value
    if type(number) is not int or not 0 <= number < MAX_FINGERS:
        raise PhoneMessageError(f"a finger's number must be 0 to {MAX_FINGERS - 1}")
    if any(type(one) not in (int, float) or not -1 <= one <= 1 for one in value[1:]):
        raise PhoneMessageError("a finger's lengths and pressure must be numbers of at most 1")
    if math.hypot(x, y) > 1 or radius < 0 or pressure < 0:
        raise PhoneMessageError("a finger must be on the dome")
    return Finger(number, x, y, radius, pressure)


def _value(text: str | bytes) -> Any:
    """Return the value of a JSON text."""
    if not isinstance(text, str):
        raise PhoneMessageError("a message must be text")
    try:
        return json.loads(text, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        raise PhoneMessageError("a message must be JSON") from error


def _no_number(name: str) -> NoReturn:
    raise ValueError(name)
