"""Tetris through the real orb's driver: the shipped bundle, two processes, emulated hardware."""

import json

import pytest

from tests.support.pytest_types import Capture

pytest.importorskip("gpiozero", reason="the emulated hardware uses gpiozero's mock pins")

from host.__main__ import main

pytestmark = pytest.mark.slow

DEMO = ["--demo", "--headless", "--seed", "5", "--seconds", "24", "--json", "--"]


def test_the_shipped_bundle_plays_through_the_driver_as_on_the_virtual_orb(capsys: Capture) -> None:
    verdicts = []
    for sensor in ("virtual", "emulated"):
        assert main([*DEMO, "--sensor", sensor]) == 0
        verdicts.append(json.loads(capsys.readouterr().out.splitlines()[-1]))
    plain, driven = verdicts
    assert driven["intended"] == plain["intended"] >= 12
    assert driven["hits"] == driven["intended"]
    for mistake in ("wrong", "missed", "false_alarms", "duplicates"):
        assert driven[mistake] == 0
    assert driven["hits"] == plain["hits"]
    assert driven["pieces"] == plain["pieces"]
