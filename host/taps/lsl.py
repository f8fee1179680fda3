"""Lab Streaming Layer tap: five outlets for each device.

Needs pylsl, whose wheels bring the library liblsl for common systems. Source of the fields in the
descriptions: LSL's metadata conventions (github.com/sccn/xdf, wiki "Meta-Data").
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from controller.shared.errors import how_to_install
from controller.shared.protocol.codec import image_from_bytes
from controller.shared.protocol.messages import Command, ContactState, Telemetry, Welcome
from host.taps import CONTACT, Tap, TapError, TapUnavailableError, log

NETWORK: Final = "network"
BUFFER_S: Final = 30  # for a slow inlet; pylsl's default of 360 s needs more memory
NONE: Final = "none"  # the marker when no gesture is held: LSL has no empty strings
_QUIET: Final = "[log]\nlevel = -2\n"  # errors only: liblsl would print every network card
_MACHINE: Final = (
    "[multicast]\nResolveScope = machine\nListenAddress = 127.0.0.1\n"
    "[ports]\nIPv6 = disable\n" + _QUIET
)
_OWN: Final = ("lsl_api.cfg", "~/lsl_api/lsl_api.cfg", "/etc/lsl_api/lsl_api.cfg")


class LslTap(Tap):
    """The outlets of one device; another device, or another shape, gets new ones.

    Frames and probabilities have the device's rate, contacts and markers none. A sample's time is
    that of the device, converted to LSL's clock by the fastest message of the session.
    """

    def __init__(self, lsl: Any) -> None:
        """Prepare without outlets; `lsl` is the module pylsl."""
        self._lsl = lsl
        self._outlets: dict[str, Any] = {}
        self._welcome: Welcome | None = None
        self._offset_s = float("inf")  # from the device's clock to LSL's

    def connected(self, welcome: Welcome) -> None:
        """Make the outlets, or keep those of the same device, so that inlets continue."""
        self._offset_s = float("inf")
        before, self._welcome = self._welcome, welcome
        if before is not None and _described(before) == _described(welcome):
            return
        self.close()
        taxels = [
            f"row{row}_column{column}"
            for row in range(welcome.rows)
            for column in range(welcome.columns)
        ]
        self._make("frames", "Capacitance", taxels, "C/C0", welcome)
        self._make("probabilities", "Probability", welcome.labels, "probability", welcome)
        self._make("contacts", "Contact", list(CONTACT), list(CONTACT.values()), welcome)
        self._make("gestures", "Markers", ("gesture",), "", welcome)
        self._make("commands", "Markers", ("command", "gesture"), "", welcome)

    def telemetry(self, message: Telemetry, t_ms: int) -> None:
        """Push a sample of each regular stream."""
        self._push("frames", image_from_bytes(message.image), t_ms)
        self._push("probabilities", list(message.probabilities), t_ms)

    def gesture(self, label: str, t_ms: int) -> None:
        """Push a marker."""
        self._push("gestures", [label or NONE], t_ms)

    def command(self, message: Command, t_ms: int) -> None:
        """Push a marker."""
        self._push("commands", [message.name, message.label], t_ms)

    def contact(self, message: ContactState, t_ms: int) -> None:
        """Push a sample; the last one of a contact is all 0."""
        self._push("contacts", [float(getattr(message, name)) for name in CONTACT], t_ms)

    def close(self) -> None:
        """Remove the outlets from the network."""
        self._outlets.clear()

    def _make(
        self, name: str, kind: str, channels: Sequence[str], unit: str | list[str], welcome: Welcome
    ) -> None:
        """Make one outlet, with its description; without a unit it is one of markers.

        With a unit for each channel its rate is irregular.
        """
        lsl, source = self._lsl, f"{welcome.device_id}:{name}"
        regular = bool(unit) and isinstance(unit, str)
        rate_hz = welcome.rate_hz if regular else lsl.IRREGULAR_RATE
        form = lsl.cf_float32 if unit else lsl.cf_string
        info = lsl.StreamInfo(f"OrbTouch {name}", kind, len(channels), rate_hz, form, source)
        info.desc().append_child_value("manufacturer", "OrbTouch")
        device = info.desc().append_child("device")
        for key, value in _described(welcome).items():
            device.append_child_value(key, value)
        info.set_channel_labels(list(channels))
        info.set_channel_types(kind)
        if unit:
            info.set_channel_units(unit)
        self._outlets[name] = lsl.StreamOutlet(info, max_buffered=BUFFER_S)

    def _push(self, name: str, sample: list[Any], t_ms: int) -> None:
        outlet = self._outlets[name]
        if len(sample) == outlet.channel_count:  # a device may send another shape
            outlet.push_sample(sample, self._time_s(t_ms))

    def _time_s(self, t_ms: int) -> float:
        """Return the device's time on LSL's clock."""
        self._offset_s = min(self._offset_s, self._lsl.local_clock() - t_ms / 1000)
        return t_ms / 1000 + self._offset_s


def _described(welcome: Welcome) -> dict[str, str]:
    """Return the description of the device; a changed one requires new outlets."""
    return {
        "id": welcome.device_id,
        "name": welcome.name,
        "virtual": str(welcome.virtual).lower(),
        "rows": str(welcome.rows),
        "columns": str(welcome.columns),
        "pitch_mm": f"{welcome.pitch_mm:g}",
        "rate_hz": f"{welcome.rate_hz:g}",
        "labels": " ".join(welcome.labels),
        "commands": " ".join(welcome.commands),
    }


def create(where: str) -> LslTap:
    """Load liblsl; its streams are announced on this machine only, or on the network.

    liblsl has no option to accept connections from this machine only: another machine that knows
    the port can read a stream. The user's configuration file, in LSLAPICFG or a standard place of
    LSL, has precedence.
    """
    if where not in ("", NETWORK):
        raise TapError(f"--tap lsl://{where} is not understood; write lsl, or lsl://{NETWORK}")
    try:
        import pylsl
    except ModuleNotFoundError:
        raise TapUnavailableError(f"--tap lsl needs pylsl; {how_to_install('lsl')}") from None
    except (OSError, RuntimeError) as error:  # pylsl is here, but not the library that it binds
        raise TapUnavailableError(
            f"--tap lsl needs the library liblsl, which this pylsl cannot load "
            f"({str(error).strip().splitlines()[0]}); install liblsl (orbtouch docs taps)"
        ) from error
    log.warning(
        "other machines can read what --tap lsl sends: liblsl listens on every network card"
    )
    own = any(Path(name).expanduser().is_file() for name in _OWN)
    if not own and "LSLAPICFG" not in os.environ:
        pylsl.set_config_content(_QUIET if where == NETWORK else _MACHINE)
    return LslTap(pylsl)
