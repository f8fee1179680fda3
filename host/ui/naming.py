"""Names of gestures and commands, and other words about the orb, in the language in use."""

import re
from functools import cache
from typing import Final

from controller.shared.notices import TEMPLATES, Notice, worded
from host.ui.unanswered import Reason
from tetris.kit.language import Words

_CODES_ONLY: Final = (
    *("all_taxels", "row", "column", "rows", "columns", "taxel", "taxel_at", "taxels"),
    *("some_taxels", "list", "gesture"),
)
_FIGURES: Final = ("count", "minutes", "number", "percent", "seconds")
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


def place(words: Words, name: str) -> str:
    """Return a place such as "row 2" in the language in use."""
    return _PLACES.sub(lambda one: words(f"dome.place.{one[0]}"), name)


def said(words: Words, sentence: str) -> str:
    """Return a sentence of the orb or the trainer in the language in use; free text as it is."""
    if isinstance(sentence, Notice):
        template = words(key := f"said.{sentence.code}")
        name = gesture if sentence.code == "gesture" else said
        arguments = [name(words, one) for one in sentence.arguments]
        return sentence if template == key else worded(sentence.code, template, arguments)
    for key, pattern in _templates():
        if found := pattern.fullmatch(sentence):
            parts = found.groupdict()
            if words(key) == key:
                return sentence
            return words(key, **{name: _part(words, name, part) for name, part in parts.items()})
    return sentence


def _part(words: Words, name: str, part: str) -> str:
    """Return what is set into a template: a place, a gesture, a sentence, or as it is."""
    if name == "where":
        return place(words, part)
    if name in ("gesture", "gestures"):
        both = words("dome.place.and")
        return f" {both} ".join(gesture(words, label) for label in part.split(" and "))
    return said(words, part) if name in ("first", "then") else part


def _group(name: re.Match[str]) -> str:
    """Return the pattern of what is set into a template."""
    return f"(?P<{name[1]}>{r'[-+.0-9]+' if name[1] in _FIGURES else '.+?'})"


@cache
def _templates() -> tuple[tuple[str, re.Pattern[str]], ...]:
    """Return the keys and patterns of the sentences, in order."""
    return tuple(
        (f"said.{code}", re.compile(re.sub(r"\\{(\w+)\\}", _group, re.escape(english))))
        for code, english in TEMPLATES.items()
        if code not in _CODES_ONLY
    )


def _known(words: Words, key: str, name: str) -> str:
    said = words(key)
    return name.replace("_", " ") if said == key else said
