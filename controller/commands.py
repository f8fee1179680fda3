"""Table of the commands of `controller`: name, module whose `main` runs it, and purpose."""

from typing import Final

RUN: Final = "controller.run"  # without a command
COMMANDS: Final[dict[str, tuple[str, str]]] = {
    "teach": ("controller.teaching.command", "record examples of your own gestures"),
    "recordings": ("controller.recordings.command", "inspect, check, convert and mend recordings"),
    "install": ("controller.shelf.install", "test a bundle on this device and take it into use"),
    "models": ("controller.shelf.models", "list the bundles of this device"),
    "rollback": ("controller.shelf.rollback", "take the previous bundle into use"),
    "calibrate": ("controller.calibrate", "measure the untouched sensor and keep the result"),
    "doctor": ("controller.doctor.command", "check computer, wiring, sensor and link"),
    "key": ("controller.key", "make a key that this orb and its host share"),
    "pair": ("controller.bluetooth.pair", "pair with a host over Bluetooth"),
    "service": ("controller.service.unit", "print a systemd unit for this installation"),
    "status": ("controller.service.status", "show service, Bluetooth and latency"),
}
