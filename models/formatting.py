"""Numbers, times and names as cards and terminals show them."""

import math
from typing import Final

from models.results.evaluation import Figure

NONE: Final = "–"  # a figure that is not known
LABELS: Final = {"null": "nothing", "twist_cw": "twist ↻", "twist_ccw": "twist ↺"}


def label(name: str) -> str:
    """Return a class's name for people."""
    return LABELS.get(name, name.replace("_", " "))


def percent(share: float, digits: int = 1) -> str:
    """Return a share, such as "98.8 %"; with two digits close to 0 and 1."""
    if not math.isfinite(share):
        return NONE
    if share in (0.0, 1.0):
        return f"{100 * share:.0f} %"
    if share > 0.99 or share < 0.01:
        digits = max(digits, 2)
    return f"{100 * share:.{digits}f} %"


def number(value: float, digits: int = 3) -> str:
    """Return a number with that many digits after the point."""
    return f"{value:.{digits}f}" if math.isfinite(value) else NONE


def count(value: float) -> str:
    """Return a whole number, thousands apart."""
    return f"{value:,.0f}".replace(",", " ") if math.isfinite(value) else NONE


def seconds(value: float) -> str:
    """Return a short time."""
    return f"{value:.2f} s" if math.isfinite(value) else NONE


def duration(value: float) -> str:
    """Return a length of time: seconds below two minutes, minutes below two hours, else hours."""
    if not math.isfinite(value):
        return NONE
    if value < 120:
        return f"{value:.0f} s"
    return f"{value / 60:.0f} min" if value < 7200 else f"{value / 3600:.1f} h"


def points(share: float) -> str:
    """Return a difference of shares in percentage points."""
    return f"{100 * share:.1f} points" if math.isfinite(share) else NONE


def share_interval(figure: Figure) -> str:
    """Return a share and its interval: "98.80 % (97.10–99.30)"."""
    return percent(figure.value, 2) + _interval(figure, 100.0, 2)


def number_interval(figure: Figure, digits: int = 3) -> str:
    """Return a number and its interval: "0.112 (0.105–0.121)"."""
    return number(figure.value, digits) + _interval(figure, 1.0, digits)


def _interval(figure: Figure, times: float, digits: int) -> str:
    if not (math.isfinite(figure.low) and math.isfinite(figure.high)):
        return ""
    return f" ({times * figure.low:.{digits}f}–{times * figure.high:.{digits}f})"
