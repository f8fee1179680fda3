"""Zones of the dome: the commands that the device's own mapping gives."""

import os

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

import numpy as np
import pygame

from controller.bundles import vocabulary
from controller.recognition import mapping
from controller.shared.protocol.teaching import CommandRule, GestureInfo
from host.ui import zones
from host.ui.pointer_input import DomeArea
from tests.support.app_window import shipped_gestures

EDGES = mapping.parse(
    {
        "press": [
            {"command": "hold", "right_of": 1.0, "left_of": 3.0, "below": 3.0, "above": 1.0},
            {"command": "none", "above": 3.5},
            {"command": "down"},
        ]
    },
    ("null", "press"),
).rules["press"]


def as_sent(rules: tuple[mapping.Rule, ...]) -> zones.Rules:
    return tuple(
        CommandRule(one.command, one.left_of, one.right_of, one.below, one.above) for one in rules
    )


def test_every_point_gets_the_command_of_the_devices_mapping() -> None:
    shipped = vocabulary.shipped().mapping.rules["press"]
    points = [(x / 8, y / 8) for x in range(-16, 49) for y in range(-16, 49)]
    for rules in (shipped, EDGES):
        device = mapping.Mapping({"press": rules})
        sent = as_sent(rules)
        for point in points:
            number = zones.zone_at(sent, point)
            command = None if number is None else sent[number].command
            assert device.command("press", point) == (None if command == "none" else command)


def test_the_shipped_zones_are_left_right_and_down() -> None:
    rules = zones.rules_in_use(shipped_gestures())
    assert [rules[zones.zone_at(rules, point) or 0].command for point in
            ((0.5, 3.0), (3.5, 3.0), (2.0, 0.0))] == ["left", "right", "down"]  # fmt: skip


def test_without_a_gesture_whose_place_matters_there_are_no_zones() -> None:
    everywhere = CommandRule("drop", np.inf, -np.inf, np.inf, -np.inf)
    assert zones.rules_in_use([GestureInfo("pinch", "", False, 0, b"", (everywhere,))]) == ()


def test_the_zone_under_the_pointer_is_lit_and_no_other() -> None:
    pygame.display.init()
    rules, pad, radius = as_sent(EDGES), DomeArea(), 100
    calm = zones.picture(rules, pad, radius, None)
    lit = zones.picture(rules, pad, radius, 0)
    unit = radius / pad.radius
    inside, outside = (round(100 + 0.7 * unit), 100), (round(100 + 1.5 * unit), 100)
    assert lit.get_at(inside).a > calm.get_at(inside).a
    assert lit.get_at(outside) == calm.get_at(outside)
