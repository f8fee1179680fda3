"""Our services and our advertisement as BlueZ wants to see them: objects on D-Bus.

The names are those of BlueZ's interfaces (doc/org.bluez.GattCharacteristic.rst and its neighbours).
Annotations are the D-Bus types, read when the classes are made.
"""

import logging
from typing import Annotated, Any, Final, Protocol

from dbus_fast import PropertyAccess
from dbus_fast.annotations import (
    DBusBool,
    DBusBytes,
    DBusDict,
    DBusObjectPath,
    DBusSignature,
    DBusStr,
    DBusUInt16,
    DBusUInt32,
)
from dbus_fast.service import ServiceInterface, dbus_method, dbus_property

from controller.links.bluetooth.hid.gatt_services import APPEARANCE, HID

CHARACTERISTIC: Final = "org.bluez.GattCharacteristic1"
INTERVAL_MS: Final = (30, 60)  # between two advertisements, so that hosts are quick to come back

log = logging.getLogger(__name__)

Words = Annotated[list[str], DBusSignature("as")]


class CharacteristicValues(Protocol):
    """Who answers hosts."""

    def read(self, name: str, offset: int, device: str) -> bytes:
        """Return a value from an offset on; `device` is the path of the host that asks."""

    def write(self, name: str, value: bytes, offset: int) -> None:
        """Take what a host writes."""

    def listened(self, name: str) -> None:
        """Somebody has begun to listen."""


class Service(ServiceInterface):
    """A service, which has nothing but characteristics."""

    def __init__(self, uuid: int) -> None:
        super().__init__("org.bluez.GattService1")
        self._uuid = uuid

    @dbus_property(access=PropertyAccess.READ)
    def UUID(self) -> DBusStr:  # noqa: N802
        """Which kind of thing it is."""
        return f"{self._uuid:04x}"

    @dbus_property(access=PropertyAccess.READ)
    def Primary(self) -> DBusBool:  # noqa: N802
        """Whether hosts find it by themselves."""
        return True


class Characteristic(ServiceInterface):
    """A value that hosts can reach."""

    def __init__(
        self,
        values: CharacteristicValues,
        label: str,
        uuid: int,
        flags: tuple[str, ...],
        service: str,
    ) -> None:
        super().__init__(CHARACTERISTIC)
        self._values, self._label = values, label
        self._uuid, self._flags, self._service = uuid, flags, service

    @dbus_property(access=PropertyAccess.READ)
    def UUID(self) -> DBusStr:  # noqa: N802
        """Which kind of thing it is."""
        return f"{self._uuid:04x}"

    @dbus_property(access=PropertyAccess.READ)
    def Service(self) -> DBusObjectPath:  # noqa: N802
        """The path of its service."""
        return self._service

    @dbus_property(access=PropertyAccess.READ)
    def Flags(self) -> Words:  # noqa: N802
        """What may be done with it."""
        return list(self._flags)

    @dbus_method()
    def ReadValue(self, options: DBusDict) -> DBusBytes:  # noqa: N802
        """A host reads."""
        return self._values.read(self._label, _number(options, "offset"), _text(options, "device"))

    @dbus_method()
    def WriteValue(self, value: DBusBytes, options: DBusDict) -> None:  # noqa: N802
        """A host writes."""
        self._values.write(self._label, value, _number(options, "offset"))

    @dbus_method()
    def StartNotify(self) -> None:  # noqa: N802
        """The first host has begun to listen."""
        self._values.listened(self._label)

    @dbus_method()
    def StopNotify(self) -> None:  # noqa: N802
        """The last one has gone."""
        log.debug("no host listens to %s", self._label)


class Descriptor(ServiceInterface):
    """Something more about a characteristic, which never changes."""

    def __init__(self, uuid: int, value: bytes, characteristic: str) -> None:
        super().__init__("org.bluez.GattDescriptor1")
        self._uuid, self._value, self._characteristic = uuid, value, characteristic

    @dbus_property(access=PropertyAccess.READ)
    def UUID(self) -> DBusStr:  # noqa: N802
        """Which kind of thing it is."""
        return f"{self._uuid:04x}"

    @dbus_property(access=PropertyAccess.READ)
    def Characteristic(self) -> DBusObjectPath:  # noqa: N802
        """The path of its characteristic."""
        return self._characteristic

    @dbus_property(access=PropertyAccess.READ)
    def Flags(self) -> Words:  # noqa: N802
        """What may be done with it."""
        return ["encrypt-read"]

    @dbus_method()
    def ReadValue(self, options: DBusDict) -> DBusBytes:  # noqa: N802
        """A host reads."""
        return self._value[_number(options, "offset") :]


class Advertisement(ServiceInterface):
    """What the orb says while it looks for a host."""

    def __init__(self, title: str, discoverable: bool) -> None:
        super().__init__("org.bluez.LEAdvertisement1")
        self._title, self._discoverable = title, discoverable

    @dbus_property(access=PropertyAccess.READ)
    def Type(self) -> DBusStr:  # noqa: N802
        """Hosts may connect."""
        return "peripheral"

    @dbus_property(access=PropertyAccess.READ)
    def ServiceUUIDs(self) -> Words:  # noqa: N802
        """By which a host knows what to use it for."""
        return [f"{HID:04x}"]

    @dbus_property(access=PropertyAccess.READ)
    def Appearance(self) -> DBusUInt16:  # noqa: N802
        """The picture that hosts show."""
        return APPEARANCE

    @dbus_property(access=PropertyAccess.READ)
    def LocalName(self) -> DBusStr:  # noqa: N802
        """The name that hosts show."""
        return self._title

    @dbus_property(access=PropertyAccess.READ)
    def Discoverable(self) -> DBusBool:  # noqa: N802
        """Whether strangers shall show it."""
        return self._discoverable

    @dbus_property(access=PropertyAccess.READ)
    def MinInterval(self) -> DBusUInt32:  # noqa: N802
        """Milliseconds between two advertisements, at least."""
        return INTERVAL_MS[0]

    @dbus_property(access=PropertyAccess.READ)
    def MaxInterval(self) -> DBusUInt32:  # noqa: N802
        """Milliseconds between two advertisements, at most."""
        return INTERVAL_MS[1]

    @dbus_method()
    def Release(self) -> None:  # noqa: N802
        """BlueZ has let go of it."""
        log.debug("BlueZ no longer advertises")


def _number(options: dict[str, Any], name: str) -> int:
    return int(options[name].value) if name in options else 0


def _text(options: dict[str, Any], name: str) -> str:
    return str(options[name].value) if name in options else ""
