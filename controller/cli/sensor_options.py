"""Options that choose a sensor, alike in all commands that read one."""

import argparse

from controller.sensors import base as sensors


def add_sensor(grammar: argparse.ArgumentParser, purpose: str) -> None:
    """Add --sensor, whose help begins with its purpose; it takes options of the sensor."""
    add = grammar.add_argument
    text = (
        f"{purpose}: {', '.join(sensors.names())}, with options of its own, such as "
        "virtual:seed=7,fault=dead:2,3 or lines:wiring=FILE, a description of the sensor or of "
        "what hangs on which pin: docs/sensors.md, docs/hardware.md (default: virtual)"
    )
    add("--sensor", metavar="NAME[:KEY=VALUE,...]", default="virtual", help=text)
