"""Table of the commands of `controller`: name, module whose `main` runs it, and purpose."""

from typing import Final

RUN: Final = "controller.cli.run"  # without a command
COMMANDS: Final[dict[str, tuple[str, str]]] = {
    "teach": ("controller.cli.teach", "record examples of your own gestures"),
    "recordings": ("controller.cli.recordings", "inspect, check, convert and mend recordings"),
    "install": (
        "controller.cli.install",
        "test a bundle on this device and take it into use",
    ),
    "models": ("controller.cli.bundles", "list the bundles of this device"),
    "rollback": ("controller.cli.rollback", "take the previous bundle into use"),
    "calibrate": (
        "controller.cli.calibrate",
        "measure the untouched sensor and keep the result",
    ),
    "doctor": ("controller.cli.doctor", "check computer, wiring, sensor and link"),
    "key": ("controller.cli.key", "make a key that this orb and its host share"),
    "pair": ("controller.cli.pair", "pair with a host over Bluetooth"),
    "service": ("controller.cli.service", "print a systemd unit for this installation"),
    "status": ("controller.cli.status", "show service, Bluetooth and latency"),
}
