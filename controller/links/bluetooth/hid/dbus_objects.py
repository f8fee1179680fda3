"""GATT services and the advertisement of the HID device, as D-Bus objects for BlueZ.

Names of interfaces, properties and methods are BlueZ's: doc/org.bluez.GattCharacteristic.rst and
related files. Annotations of methods are D-Bus types, evaluated when the classes are made.
"""

import logging
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Final

from dbus_fast import PropertyAccess
from dbus_fast.annotations import DBusBytes, DBusDict, DBusSignature
from dbus_fast.service import ServiceInterface, dbus_method, dbus_property

from controller.links.bluetooth.hid import gatt_services
from controller.links.bluetooth.hid.gatt_services import APPEARANCE, HID

if TYPE_CHECKING:
    from controller.links.bluetooth.hid.gatt import GattTransport

CHARACTERISTIC: Final = "org.bluez.GattCharacteristic1"
INTERVAL_MS: Final = (30, 60)  # between two advertisements, for a fast reconnection

log = logging.getLogger(__name__)


def service(uuid: int) -> ServiceInterface:
    """Return a service without characteristics."""
    properties = {"UUID": ("s", f"{uuid:04x}"), "Primary": ("b", True)}
    return _with_properties(ServiceInterface, properties)("org.bluez.GattService1")


def characteristic(
    one: gatt_services.Characteristic, path: str, transport: "GattTransport"
) -> ServiceInterface:
    """Return a characteristic of the service at a path; the transport reads and writes it."""
    properties = {
        "UUID": ("s", f"{one.uuid:04x}"),
        "Service": ("o", path),
        "Flags": ("as", list(one.flags)),
    }
    return _with_properties(_Characteristic, properties)(one.name, transport)


def descriptor(uuid: int, value: bytes, path: str) -> ServiceInterface:
    """Return a constant descriptor of the characteristic at a path."""
    properties = {
        "UUID": ("s", f"{uuid:04x}"),
        "Characteristic": ("o", path),
        "Flags": ("as", ["encrypt-read"]),
    }
    return _with_properties(_Descriptor, properties)(value)


def advertisement(name: str, discoverable: bool) -> ServiceInterface:
    """Return the advertisement of a name; if discoverable, for hosts that are not paired, too."""
    properties = {
        "Type": ("s", "peripheral"),  # hosts may connect
        "ServiceUUIDs": ("as", [f"{HID:04x}"]),
        "Appearance": ("q", APPEARANCE),
        "LocalName": ("s", name),
        "Discoverable": ("b", discoverable),
        "MinInterval": ("u", INTERVAL_MS[0]),
        "MaxInterval": ("u", INTERVAL_MS[1]),
    }
    return _with_properties(_Advertisement, properties)("org.bluez.LEAdvertisement1")


class _Characteristic(ServiceInterface):
    def __init__(self, name: str, transport: "GattTransport") -> None:
        super().__init__(CHARACTERISTIC)
        self._name, self._transport = name, transport

    @dbus_method()
    def ReadValue(self, options: DBusDict) -> DBusBytes:  # noqa: N802
        device = str(_option(options, "device", ""))
        return self._transport.read(self._name, int(_option(options, "offset", 0)), device)

    @dbus_method()
    def WriteValue(self, value: DBusBytes, options: DBusDict) -> None:  # noqa: N802
        self._transport.write(self._name, value, int(_option(options, "offset", 0)))

    @dbus_method()
    def StartNotify(self) -> None:  # noqa: N802
        self._transport.subscribed(self._name)

    @dbus_method()
    def StopNotify(self) -> None:  # noqa: N802
        log.debug("no host is subscribed to %s", self._name)


class _Descriptor(ServiceInterface):
    def __init__(self, value: bytes) -> None:
        super().__init__("org.bluez.GattDescriptor1")
        self._value = value

    @dbus_method()
    def ReadValue(self, options: DBusDict) -> DBusBytes:  # noqa: N802
        return self._value[int(_option(options, "offset", 0)) :]


class _Advertisement(ServiceInterface):
    @dbus_method()
    def Release(self) -> None:  # noqa: N802
        log.debug("BlueZ no longer advertises")


def _with_properties(
    kind: Any, properties: dict[str, tuple[str, Any]]
) -> Callable[..., ServiceInterface]:
    """Return a class with constant properties: the D-Bus type and the value of each."""
    return type(kind.__name__, (kind,), {n: _constant(n, *one) for n, one in properties.items()})


def _constant(name: str, signature: str, value: Any) -> Any:
    def read(self: Any) -> Any:
        return value

    read.__name__ = name  # dbus-fast finds it by name
    read.__annotations__["return"] = Annotated[Any, DBusSignature(signature)]
    return dbus_property(PropertyAccess.READ, name)(read)


def _option(options: dict[str, Any], name: str, default: Any) -> Any:
    return options[name].value if name in options else default
