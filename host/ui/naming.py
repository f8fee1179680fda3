"""Names of gestures and commands, and other words about the orb, in the language in use."""

import re
from typing import Final

from host.ui.unanswered import Reason
from tetris.window.language import Words

# Sentences of `Health` and the keys of their words; groups are set into them.
_HEALTH: Final = (
    ("no_signal", r"(?P<where>.+): no signal"),
    ("crackles", r"a lead crackles"),
    ("dead", r"(?P<where>.+): no answer to touch"),
    ("busy", r"no quiet second"),
    ("touched", r"something has touched the orb for (?P<minutes>\d+) min"),
    ("pressure_down", r"pressure down (?P<percent>\d+) %"),
    ("pressure_up", r"pressure up (?P<percent>\d+) %"),
    ("lead", r"(?P<where>.+) has drifted by (?P<percent>[+-]\d+) %; look at its lead"),
    ("film", r"(?P<where>.+): drifted by (?P<percent>[+-]\d+) %; the film"),
)
_PLACES: Final = re.compile(r"\b(taxels?|rows?|columns?|all|and|of)\b")


def gesture(words: Words, label: str) -> str:
    """Return a gesture's name; of one that is not shipped its label in words."""
    return _known(words, f"dome.gesture.{label}", label)


def command(words: Words, name: str) -> str:
    """Return a command's name; of one of a program's own its name in words."""
    return _known(words, f"dome.command.{name}", name)


def unanswered(words: Words, reason: Reason) -> str:
    """Return why a touch gave no command, a sentence."""
    names = [gesture(words, label) for label in reason.labels]
    return words(f"dome.unanswered.{reason.key}").format(*names)


def health(words: Words, sentence: str) -> str:
    """Return a sentence of `Health` in the language in use; an unknown one as it is."""
    for key, pattern in _HEALTH:
        if found := re.match(pattern, sentence):
            parts = found.groupdict()
            if "where" in parts:
                place = _PLACES.sub(lambda one: words(f"dome.place.{one[0]}"), parts["where"])
                parts["where"] = place
            return words(f"dome.health.{key}", **parts)
    return sentence


def _known(words: Words, key: str, name: str) -> str:
    said = words(key)
    return name.replace("_", " ") if said == key else said
