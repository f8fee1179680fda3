"""Sweeps to begin with: a file for each kind of question."""

from importlib.resources import files
from typing import Final

FIRST: Final = "try"
# Name -> what it is, in the order in which they are told.
NAMES: Final = {
    FIRST: "a minute",
    "figure7b": "gestures over minutes taught",
    "figure7d": "ten people told apart over minutes recorded",
    "figure7f": "places over minutes taught",
    "crossed": "cross-validation over users",
    "search": "settings and seeds",
    "days": "people told apart over days recorded",
}


def text(name: str = FIRST) -> str:
    """Return the file of that name."""
    return files(__package__).joinpath("examples", f"{name}.toml").read_text(encoding="utf-8")
