"""HID reports, read by a parser that was written from the specification."""

import hashlib

import pygame
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.links.bluetooth.hid import reports
from controller.shared.protocol.messages import ContactState
from tests.reference import hid

HOST = hid.parse(reports.REPORT_MAP)
KEYS, LEDS, BUTTONS, DESKTOP = 0x07 << 16, 0x08 << 16, 0x09 << 16, 0x01 << 16
X, Y, HAT = DESKTOP | 0x30, DESKTOP | 0x31, DESKTOP | 0x39
ACROSS, DOWN, TRIGGER = DESKTOP | 0x32, DESKTOP | 0x35, 0x02 << 16 | 0xC4  # Z, Rz, accelerator
FIRST_MODIFIER = KEYS | 0xE0


def down(report_id: int, data: bytes) -> set[int]:
    """Return the usages that a host takes to be down, the hat and the stick apart."""
    values = HOST.decode(hid.INPUT, report_id, data)
    return {usage for usage, value in values.items() if value and usage not in (X, Y, HAT)}


def pad(*names: str) -> dict[int, int | None]:
    """Return what a host reads from the gamepad's report."""
    return HOST.decode(hid.INPUT, reports.GAMEPAD, reports.gamepad(names).data)


def test_a_host_finds_one_keyboard_and_one_gamepad() -> None:
    applications = {one.state.id: one.application for one in HOST.fields}
    assert applications == {reports.KEYBOARD: DESKTOP | 0x06, reports.GAMEPAD: DESKTOP | 0x05}
    assert HOST.ids(hid.OUTPUT) == {reports.KEYBOARD}
    assert HOST.bits(hid.INPUT, reports.KEYBOARD) == 64  # as the boot protocol's
    assert HOST.bits(hid.OUTPUT, reports.KEYBOARD) == 8
    assert HOST.bits(hid.INPUT, reports.GAMEPAD) == 64


def test_the_lights_of_the_keyboard_are_five() -> None:
    lights = HOST.decode(hid.OUTPUT, reports.KEYBOARD, b"\x02")
    assert lights == {LEDS | 1: 0, LEDS | 2: 1, LEDS | 3: 0, LEDS | 4: 0, LEDS | 5: 0}


def test_nothing_is_down_in_the_reports_that_release_everything() -> None:
    for report in reports.RELEASED:
        assert down(report.id, report.data) == set()
    rest = {HAT: None, **dict.fromkeys((X, Y, ACROSS, DOWN, TRIGGER), 0)}
    assert pad() == {**{BUTTONS | n: 0 for n in range(1, 17)}, **rest}
    assert {report.id for report in reports.RELEASED} == HOST.ids(hid.INPUT)


# SDL's scan codes are HID usages (SDL_scancode.h says so), and pygame has them by name.
SCAN_CODES = {
    "enter": "RETURN", "minus": "MINUS", "equal": "EQUALS", "rctrl": "RCTRL", "ctrl": "LCTRL",
    "shift": "LSHIFT", "rshift": "RSHIFT", "alt": "LALT", "altgr": "RALT", "meta": "LGUI",
    "apostrophe": "APOSTROPHE", "mute": "MUTE",
}  # fmt: skip


@pytest.mark.parametrize("name", reports.KEY_USAGES)
def test_every_key_has_the_number_that_sdl_knows(name: str) -> None:
    spelled = SCAN_CODES.get(name, name.upper())
    expected = getattr(pygame, f"KSCAN_{spelled}", None)
    if expected is None:
        expected = {"volumeup": 128, "volumedown": 129, "mute": 127}[name]  # SDL_scancode.h
    assert reports.KEY_USAGES[name] == expected


@settings(deadline=None)
@given(st.lists(st.sampled_from(sorted(reports.KEY_USAGES)), max_size=14, unique=True))
def test_a_host_reads_the_keys_that_are_down(names: list[str]) -> None:
    usages = {KEYS | reports.KEY_USAGES[name] for name in names}
    modifiers = {usage for usage in usages if usage >= FIRST_MODIFIER}
    told = usages if len(usages - modifiers) <= 6 else modifiers | {KEYS | 1}  # ErrorRollOver
    assert down(reports.KEYBOARD, reports.keyboard(names).data) == told


@settings(deadline=None)
@given(st.sets(st.sampled_from(reports.PAD_NAMES)))
def test_a_host_reads_what_is_down_on_the_pad(names: set[str]) -> None:
    report = reports.gamepad(names)
    buttons = {BUTTONS | number for name, number in reports.BUTTON_NUMBERS.items() if name in names}
    assert down(reports.GAMEPAD, report.data) == buttons
    values = HOST.decode(hid.INPUT, reports.GAMEPAD, report.data)
    for axis, less, more in ((X, "stick_left", "stick_right"), (Y, "stick_up", "stick_down")):
        assert values[axis] == 127 * ((more in names) - (less in names))


@pytest.mark.parametrize(
    ("names", "degrees"),
    [
        (("up",), 0), (("up", "right"), 45), (("right",), 90), (("right", "down"), 135),
        (("down",), 180), (("down", "left"), 225), (("left",), 270), (("left", "up"), 315),
        (("left", "right"), None), (("left", "right", "up"), 0),
    ],
)  # fmt: skip
def test_the_hat_points_clockwise_from_up(names: tuple[str, ...], degrees: int | None) -> None:
    field = next(one for one in HOST.fields if HAT in one.usages)
    low, high = field.state.physical
    assert field.state.unit == 0x14  # degrees
    value = pad(*names)[HAT]
    assert (None if value is None else low + value * (high - low) // 7) == degrees


@pytest.mark.parametrize(
    ("contact", "across", "towards", "depth"),
    [
        (ContactState(1, 0.0, 4.0, depth_mm=3.0, fingers=1), -127, -127, 64),  # far left
        (ContactState(1, 2.0, 2.0, depth_mm=12.0, fingers=2), 0, 0, 255),  # the middle, fully
        (ContactState(1, 4.3, -0.2, depth_mm=15.0, fingers=1), 127, 127, 255),  # beyond near right
        (ContactState(1), 0, 0, 0),  # the contact has ended
    ],
)
def test_a_host_reads_place_and_depth_as_axes(
    contact: ContactState, across: int, towards: int, depth: int
) -> None:
    report = reports.gamepad(("a",), reports.axes(contact, (5, 5)))
    values = HOST.decode(hid.INPUT, reports.GAMEPAD, report.data)
    assert (values[ACROSS], values[DOWN], values[TRIGGER]) == (across, towards, depth)
    assert (values[BUTTONS | 1], values[X], values[Y]) == (1, 0, 0)


def test_only_a_contact_is_replaced_by_a_newer_one() -> None:
    touch = reports.axes(ContactState(1, 3.0, 1.0, depth_mm=5.0, fingers=1), (5, 5))
    assert reports.supersedes(reports.gamepad(()), reports.gamepad((), touch))
    assert not reports.supersedes(reports.gamepad(()), reports.gamepad(("a",), touch))
    assert not reports.supersedes(reports.keyboard("abcd"), reports.keyboard("abc"))


def test_the_keyboards_report_is_the_one_of_the_boot_protocol() -> None:
    assert reports.keyboard(("ctrl", "rshift", "left", "a")).data == bytes(
        [0x21, 0, 0x50, 4, 0, 0, 0, 0]
    )


def test_the_version_follows_from_the_report_map() -> None:
    source, vendor, product = reports.PNP_ID[0], reports.PNP_ID[1:3], reports.PNP_ID[3:5]
    assert (source, int.from_bytes(vendor, "little")) == (2, reports.VENDOR)
    assert int.from_bytes(product, "little") == 1
    assert reports.PNP_ID[5:][::-1] == hashlib.sha256(reports.REPORT_MAP).digest()[:2]
