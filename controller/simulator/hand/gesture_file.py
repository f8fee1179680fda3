"""Gesture files of the simulated hand: those that ship and a user's own, checked."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.shared import config
from controller.simulator.hand.gesture import (
    Count,
    Gesture,
    GestureError,
    Key,
    Quantity,
    checked,
    count,
    parse_term,
    quantity,
)
from controller.simulator.hand.user_style import PARAMETERS, draw_style

FINGERS: Final = 6  # at once
DEEPEST_MM: Final = 20.0  # a finger; the contact model is linear (docs/simulator.md)

Repertoire = Mapping[str, Gesture]
_Table = dict[str, Any]

_NAME: Final = re.compile(r"[a-z][a-z0-9_]{0,31}")
_TRACKS: Final = ("depth", "reach", "angle", "x", "y")
_NUMBERS: Final = (
    *("yaw", "radius", "fan", "line", "lead", "lag", "late", "early"),
    *("tremble", "tremble_hz"),
)
_REHEARSALS: Final = 8


@cache
def shipped() -> Repertoire:
    """Return the gestures that ship, by label."""
    return parse(_shipped_tables())


def _shipped_tables() -> dict[str, _Table]:
    """Return the gestures that ship as tables, by file name, in order."""
    folder = files("controller.simulator.hand") / "gestures"
    found = sorted(folder.iterdir(), key=lambda file: file.name)
    return {f.name: config.parse_toml(f.read_bytes()) for f in found if f.name.endswith(".toml")}


def load(paths: Iterable[Path]) -> Repertoire:
    """Return the gestures that ship and those of these files.

    Raises:
        GestureError: A file cannot be read, or holds no gesture; one sentence.
    """
    own = {str(path): _read(path) for path in paths}
    return parse({**_shipped_tables(), **own}) if own else shipped()


def label_in(path: Path) -> str:
    """Return the label of the gesture in a file.

    Raises:
        GestureError: It has none.
    """
    return _label(str(path), _read(path))


def _read(path: Path) -> _Table:
    return config.checked(path, dict, GestureError, "orbtouch docs gestures")


def parse(given: Mapping[str, _Table]) -> Repertoire:
    """Return the gestures in tables by file name, by label; errors begin with the file's name.

    Raises:
        GestureError: One of them is no gesture, or they do not fit together.
    """
    tables: dict[str, tuple[str, _Table]] = {}
    for source, table in given.items():
        label = _label(source, table)
        if label in tables:
            raise GestureError(f"{source} and {tables[label][0]} are both {label!r}; rename one")
        tables[label] = (source, table)
    made = {label: _gesture(source, _whole(label, tables)) for label, (source, _) in tables.items()}
    for label, gesture in made.items():
        _check_form(tables[label][0], gesture, made)
        _rehearse(tables[label][0], gesture)
    return made


def _label(source: str, table: _Table) -> str:
    label = table.get("label")
    if not isinstance(label, str) or not _NAME.fullmatch(label) or label == "null":
        raise GestureError(
            f"{source} has label = {label!r}; write a name of small letters, digits and _, "
            'not "null"'
        )
    return label


def _whole(label: str, tables: Mapping[str, tuple[str, _Table]]) -> _Table:
    """Return a gesture's table with what it takes over from the one that it is like."""
    source, table = tables[label]
    model = table.get("like")
    if model is None:
        return table
    if model not in tables or "like" in tables[model][1]:
        raise GestureError(f"{source} is like {model!r}, which is no gesture with a whole file")
    base = tables[model][1]
    joined = {**base, **table}
    for part in ("vary", "quick", "path"):
        for side in (base, table):
            _table(side.get(part, {}), f"{source} [{part}]")
        joined[part] = {**base.get(part, {}), **table.get(part, {})}
    del joined["like"]
    return joined


def _gesture(source: str, table: _Table) -> Gesture:
    """Return the gesture of one whole table, with its quick form if there is one."""
    quick, vary = (_table(table.get(name, {}), f"{source} [{name}]") for name in ("quick", "vary"))
    usual = {name: value for name, value in table.items() if name != "quick"}
    if unknown := sorted(set(quick) - set(vary)):
        raise GestureError(f"{source} [quick] has {unknown[0]!r}, which [vary] does not have")
    form = _form(source, usual)
    return (
        replace(form, quick=_form(source, {**usual, "vary": {**vary, **quick}})) if quick else form
    )


def _form(source: str, table: _Table) -> Gesture:
    """Return the gesture of one whole table without its quick form."""
    names = list(PARAMETERS)
    vary: list[tuple[str, Quantity | Count]] = []
    for name, raw in _table(table.get("vary", {}), f"{source} [vary]").items():
        where = f"{source} [vary] {name}"
        if name in PARAMETERS:
            raise GestureError(f"{where} is a user's parameter already; choose another name")
        if name == "fingers":
            if any(_each(line) for _, line in vary):
                raise GestureError(f"{where} comes after a line that each finger draws; move it up")
            vary.append((name, count(raw, names, where)))
        else:
            vary.append((name, quantity(raw, names, where)))
            names.append(name)
    path = _table(table.get("path", {}), f"{source} [path]")
    if unknown := sorted(set(path) - {*_TRACKS, "angles", *_NUMBERS}):
        raise GestureError(f"{source} [path] has {unknown[0]!r}, which is unknown")
    phases = _keys(table.get("phases"), names, f"{source} phases")
    fields: _Table = {"vary": tuple(vary), "phases": phases}
    for name, raw in path.items():
        where = f"{source} [path] {name}"
        keys = _keys([raw] if name in _NUMBERS else raw, names, where)
        if name in _TRACKS and len(keys) not in (1, 2, len(phases) + 1):
            raise GestureError(
                f"{where} has {len(keys)} keys; write 1 (it stays so), 2 (evenly from begin to "
                f"end) or {len(phases) + 1} (one more than phases)"
            )
        fields[name] = keys[0] if name in _NUMBERS else keys
    depth = fields.get("depth", ())
    if len(depth) != len(phases) + 1 or depth[0] != 0.0 or depth[-1] != 0.0:
        raise GestureError(
            f"{source} [path] depth has {len(depth)} keys; write one more than phases, "
            f"{len(phases) + 1}, the first and the last of them 0"
        )
    head = {name: value for name, value in table.items() if name not in ("vary", "path")}
    if unknown := sorted(set(head) & {*_TRACKS, "angles", *_NUMBERS}):
        raise GestureError(f"{source} has {unknown[0]!r} above [path]; write it there")
    return checked(Gesture, {**head, **fields}, source)


def _each(line: Quantity | Count) -> bool:
    return isinstance(line, Quantity) and bool(line.each or line.delay)


def _table(raw: Any, where: str) -> _Table:
    if not isinstance(raw, dict):
        raise GestureError(f"{where} is {raw!r}; write a table of name = value")
    return raw


def _keys(raw: Any, names: list[str], where: str) -> tuple[Key, ...]:
    if not isinstance(raw, list) or not raw:
        raise GestureError(f"{where} is {raw!r}; write a list of numbers and names")
    keys = []
    for key in raw:
        term = parse_term(key, names, where)
        if isinstance(term, tuple):
            raise GestureError(f"{where} has the range {key!r}; draw it in [vary] and name it")
        keys.append(term)
    return tuple(keys)


def _check_form(source: str, gesture: Gesture, all_of_them: Repertoire) -> None:
    usual = all_of_them.get(gesture.form_of)
    if gesture.form_of and (usual is None or not usual.usual):
        raise GestureError(
            f"{source} has form_of = {gesture.form_of!r}, which is no gesture in its usual form"
        )


def _rehearse(source: str, gesture: Gesture) -> None:
    """Let a few users try, and refuse what cannot be simulated."""
    for seed in range(_REHEARSALS):
        rng = np.random.default_rng(seed)
        try:
            with np.errstate(all="ignore"):
                points, depth, radius = gesture.move(draw_style(rng), rng, 50.0)
        except ValueError as error:
            raise GestureError(f"{source} cannot be performed: {error}") from None
        if not all(np.isfinite(part).all() for part in (points, depth, radius)):
            raise GestureError(f"{source} divides by a phase of no time; let each phase last")
        fingers, deepest = depth.shape[1], float(depth.max())
        if fingers > FINGERS or not 0.1 < deepest <= DEEPEST_MM:
            raise GestureError(
                f"{source} has {fingers} fingers that reach {deepest:.1f} mm of depth; "
                f"at most {FINGERS} fingers can reach between 0.1 and {DEEPEST_MM:g} mm"
            )
