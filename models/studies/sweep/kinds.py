"""Kinds of values that a sweep's file takes: readers that return the value, or say why not."""

from collections.abc import Callable, Sequence
from typing import Any

Kind = Callable[[Any], Any]


def whole(least: int, most: int) -> Kind:
    """Return what reads whole numbers of a range."""

    def read(value: Any) -> int:
        if type(value) is not int or not least <= value <= most:
            raise ValueError(f"expected a whole number from {least} to {most}, found {told(value)}")
        return value

    return read


def number(least: float, most: float) -> Kind:
    """Return what reads numbers of a range."""

    def read(value: Any) -> float:
        if type(value) not in (int, float) or not least <= value <= most:
            raise ValueError(f"expected a number from {least:g} to {most:g}, found {told(value)}")
        return float(value)

    return read


def word(*known: str) -> Kind:
    """Return what reads one of some words."""

    def read(value: Any) -> str:
        if value not in known or not isinstance(value, str):
            raise ValueError(f"expected one of {', '.join(known)}, found {told(value)}")
        return value

    return read


def texts(what: str) -> Kind:
    """Return what reads a list of texts, or one alone."""

    def read(value: Any) -> list[str]:
        listed = [value] if isinstance(value, str) else value
        if not (isinstance(listed, list) and listed and all(isinstance(v, str) for v in listed)):
            raise ValueError(f"expected {what}, found {told(value)}")
        return listed

    return read


def like(own: Any) -> Kind:
    """Return what reads values of the kind that a setting has already.

    Whole numbers do where a number is wanted; a row of numbers has as many as it had.
    """

    def read(value: Any) -> Any:
        if isinstance(own, tuple):
            if isinstance(value, list) and len(value) == len(own):
                return [like(one)(item) for one, item in zip(own, value, strict=True)]
            raise ValueError(f"expected a row such as {list(own)}, found {told(value)}")
        if type(own) is float and type(value) is int:
            return float(value)
        if type(value) is not type(own):
            kinds = {bool: "true or false", int: "a whole number", float: "a number"}
            wanted = kinds.get(type(own), "a text")
            raise ValueError(f"expected {wanted}, such as {told(own)}, found {told(value)}")
        return value

    return read


def told(value: Any) -> str:
    """Return a value as the file has it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(map(told, value))}]"
    return f'"{value}"' if isinstance(value, str) else str(value)
