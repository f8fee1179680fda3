"""Reads report descriptors and reports, as a host does.

Written from "Device Class Definition for Human Interface Devices (HID)", version 1.11: items from
section 6.2.2, reports from section 8. It knows nothing of the orb. What a host's parser may refuse
is refused here: items cut short, ranges turned round, reports that end within a byte.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

MAIN, GLOBAL, LOCAL = 0, 1, 2
INPUT, OUTPUT, COLLECTION, FEATURE, END_COLLECTION = 8, 9, 10, 11, 12  # tags of main items
CONSTANT, VARIABLE, RELATIVE, NULL_STATE = 0x01, 0x02, 0x04, 0x40  # bits of a field
SIGNED_TAGS = (1, 2, 3, 4)  # global items: logical and physical minimum and maximum


@dataclass(frozen=True)
class Globals:
    """The item state table, section 6.2.2.7."""

    page: int = 0
    logical: tuple[int, int] = (0, 0)
    physical: tuple[int, int] = (0, 0)
    unit_exponent: int = 0
    unit: int = 0
    size: int = 0
    id: int = 0
    count: int = 0


@dataclass(frozen=True)
class Field:
    """One main item: `count` values of `size` bits, from `offset` on."""

    kind: int  # INPUT, OUTPUT or FEATURE
    flags: int
    offset: int
    application: int  # the usage (page << 16 | id) of the collection at the top
    usages: tuple[int, ...]  # one a value, or, of an array, one a possible value
    state: Globals


@dataclass
class Descriptor:
    """All fields of all reports, in order."""

    fields: list[Field] = field(default_factory=list)

    def ids(self, kind: int) -> set[int]:
        """Return the report ids that are used in one direction."""
        return {one.state.id for one in self.fields if one.kind == kind}

    def bits(self, kind: int, report_id: int) -> int:
        """Return the length of a report in bits, its id apart."""
        return sum(
            one.state.size * one.state.count
            for one in self.fields
            if one.kind == kind and one.state.id == report_id
        )

    def decode(self, kind: int, report_id: int, data: bytes) -> dict[int, int | None]:
        """Return usage -> value; None: null state. ValueError: another length, or out of range."""
        if len(data) * 8 != self.bits(kind, report_id):
            raise ValueError(f"report {report_id} has {len(data)} bytes")
        word = int.from_bytes(data, "little")
        values: dict[int, int | None] = {}
        for one in self.fields:
            if one.kind == kind and one.state.id == report_id and not one.flags & CONSTANT:
                values.update(_values(one, word))
        return values


def _values(one: Field, word: int) -> dict[int, int | None]:
    low, high = one.state.logical
    values: dict[int, int | None] = {}
    for index in range(one.state.count):
        raw = word >> one.offset + index * one.state.size & (1 << one.state.size) - 1
        if low < 0 and raw >> one.state.size - 1:
            raw -= 1 << one.state.size
        inside = low <= raw <= high
        if one.flags & VARIABLE:
            if not inside and not one.flags & NULL_STATE:
                raise ValueError(f"value {raw} is outside of {one.state.logical}")
            values[one.usages[min(index, len(one.usages) - 1)]] = raw if inside else None
        elif inside and raw - low < len(one.usages):
            usage = one.usages[raw - low]
            if usage & 0xFFFF:  # 0 says that nothing is down in this place
                values[usage] = 1
    return values


def parse(data: bytes) -> Descriptor:
    """Return what a report descriptor describes."""
    descriptor, state, stack = Descriptor(), Globals(), []
    depth, application = 0, 0
    usages: list[int] = []
    span: list[int] = []
    offsets: dict[tuple[int, int], int] = {}
    for kind, tag, unsigned, signed in _items(data):
        if kind == GLOBAL:
            if tag == 10:
                stack.append(state)
            elif tag == 11:
                state = stack.pop()
            else:
                state = _set(state, tag, signed if tag in SIGNED_TAGS else unsigned)
        elif kind == LOCAL:
            full = unsigned if unsigned > 0xFFFF else state.page << 16 | unsigned
            if tag == 0:
                usages.append(full)
            elif tag in (1, 2):
                span.append(full)
                if len(span) == 2:
                    if span[0] > span[1]:
                        raise ValueError("a usage minimum is above its maximum")
                    usages += range(span[0], span[1] + 1)
                    span = []
        else:
            if tag == COLLECTION:
                if depth == 0:
                    application = usages[-1]
                    if unsigned != 1:
                        raise ValueError("the collection at the top is no application")
                depth += 1
            elif tag == END_COLLECTION:
                depth -= 1
            else:
                if depth == 0 or state.logical[0] > state.logical[1]:
                    raise ValueError("a field is outside of all collections, or its range is empty")
                if not unsigned & CONSTANT and not usages:
                    raise ValueError("a field has no usage")
                key = (tag, state.id)
                offset = offsets.get(key, 0)
                descriptor.fields.append(
                    Field(tag, unsigned, offset, application, tuple(usages), state)
                )
                offsets[key] = offset + state.size * state.count
            usages, span = [], []  # local items end with the next main item
    if depth or span or stack:
        raise ValueError("a collection, a usage range or a push is left open")
    for (kind, report_id), bits in offsets.items():
        if bits % 8:
            raise ValueError(f"report {report_id} of kind {kind} ends within a byte")
    return descriptor


def _items(data: bytes) -> list[tuple[int, int, int, int]]:
    """Return (type, tag, data unsigned, data signed) of every short item, section 6.2.2.2."""
    items, at = [], 0
    while at < len(data):
        prefix = data[at]
        size = (0, 1, 2, 4)[prefix & 3]
        body = data[at + 1 : at + 1 + size]
        if prefix == 0xFE or len(body) < size:
            raise ValueError(f"the item at {at} is long, or cut short")
        unsigned = int.from_bytes(body, "little")
        signed = int.from_bytes(body, "little", signed=True)
        items.append((prefix >> 2 & 3, prefix >> 4, unsigned, signed))
        at += 1 + size
    return items


def _set(state: Globals, tag: int, value: int) -> Globals:
    """Return the state after a global item, section 6.2.2.7."""
    if tag == 8 and not 1 <= value <= 255:
        raise ValueError(f"a report's id is {value}")
    if not 0 <= tag <= 9:
        raise ValueError(f"the global item {tag} is unknown")
    name = _GLOBALS[tag]
    new: Any = value
    if tag in SIGNED_TAGS:
        low, high = getattr(state, name)
        new = (value, high) if tag in (1, 3) else (low, value)
    return replace(state, **{name: new})


_GLOBALS = (  # by tag
    "page", "logical", "logical", "physical", "physical", "unit_exponent", "unit", "size", "id",
    "count",
)  # fmt: skip
