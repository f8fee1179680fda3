"""Names of gestures and commands, and other words about the orb, in the language in use."""

import re
from itertools import zip_longest
from typing import Final

from controller.shared.notices import TEMPLATES, Notice, names, worded
from host.ui.unanswered import Reason
from tetris.kit.language import Words

_NUMBER_PATTERN: Final = re.compile(r"[+-]?\d+(\.\d+)?%?")


def gesture(words: Words, label: str) -> str:
    """Return a gesture's name; of one that is not shipped its label in words; "" is nothing."""
    return _known(words, f"dome.gesture.{label or 'null'}", label)


def command(words: Words, name: str) -> str:
    """Return a command's name; of one of a program's own its name in words; "" is nothing."""
    return _known(words, f"dome.command.{name or 'none'}", name)


def check_name(words: Words, name: str) -> str:
    """Return the name of a thing that was checked, such as "row 2" or "leads"."""
    return _known(words, f"check.name.{name}", said(words, name))


def mapping(words: Words, name: str) -> str:
    """Return the name of a mapping, or of one of its profiles."""
    return _known(words, f"programs.name.{name}", name)


def unanswered(words: Words, reason: Reason) -> str:
    """Return why a touch gave no command, a sentence."""
    names = [gesture(words, label) for label in reason.labels]
    return words(f"dome.unanswered.{reason.key}").format(*names)


def said(words: Words, sentence: str) -> str:
    """Return a sentence, or a number in one, in the language in use; free text as it is."""
    if not isinstance(sentence, Notice):
        return words.number(sentence) if _NUMBER_PATTERN.fullmatch(sentence) else sentence
    code = sentence.code
    template = words(key := f"said.{code}")
    arguments = [
        gesture(words, one.strip("'")) if name == "label" else said(words, one)
        for name, one in zip_longest(names(code), sentence.arguments)
    ]
    return worded(code, TEMPLATES[code] if template == key else template, arguments)


def _known(words: Words, key: str, name: str) -> str:
    said = words(key)
    return name.replace("_", " ") if said == key else said
