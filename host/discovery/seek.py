"""From a device's identity to an open port, whichever port it is behind today."""

from __future__ import annotations

import logging
from dataclasses import replace

from controller.protocol.messages import Welcome
from host.connection.device_store import DeviceStore
from host.connection.transport import LinkError, Transport, open_transport
from host.discovery import search
from host.discovery.notes import note
from host.discovery.ports import Port
from host.discovery.probe import Answer

log = logging.getLogger(__name__)


class DevicePort:
    """Opens the port of one device: pass `open` to a Receiver, and `hear` to whoever polls it.

    Attributes:
        url: Where the device was last.
    """

    def __init__(self, words: str, memory: DeviceStore, key: str = "") -> None:
        """Look for a device now.

        Args:
            words: Its identity or its name.
            memory: Where devices were before.
            key: The file with its key; "": the one that is remembered, if any.

        Raises:
            LinkError: It is nowhere, or the words mean several devices.
        """
        self._words, self._memory, self._key = words, memory, key
        answer = self._seek()
        self.device_id, self.url = answer.device_id, answer.url

    def open(self) -> Transport:
        """Open the port where it was last; if there is none any more, look for it anew.

        Raises:
            LinkError: It is nowhere.
        """
        try:
            return open_transport(self.url)
        except LinkError as error:
            log.info("%s; looking for %s", error, self.device_id)
            self._words = self.device_id
            self.url = self._seek().url
            return open_transport(self.url)

    def accept(self, welcome: Welcome) -> None:
        """Check the device that has connected.

        Raises:
            LinkError: Another device is behind the port now.
        """
        if welcome.device_id != self.device_id:
            raise LinkError(
                f"at {self.url} is now {welcome.device_id}, not {self.device_id}; "
                "start again, and it is looked for on the other ports"
            )

    def _seek(self) -> Answer:
        known = self._memory.named(self._words)
        # Where it was first: if it is there, no other port need be touched.
        first = [device.port for device in known if device.port]
        key = self._key or next((device.key for device in known), "")
        answers = search.ask_all([Port(url, key=key) for url in first])
        if not _matching(answers, self._words):
            others = search.candidates(self._memory)
            rest = [replace(port, key=key) for port in others if port.url not in first]
            answers += search.ask_all(rest)
        note(self._memory, answers)
        found = _matching(answers, self._words)
        if len(found) == 1:
            return found[0]
        if found:
            places = ", ".join(f"{a.device_id} at {a.url}" for a in found)
            raise LinkError(f"{self._words!r} is not one device: {places}; use --link")
        here = ", ".join(a.device_id for a in answers if a.outcome == "orb") or "no orb"
        why = next((a.why for a in answers if a.url in first), "")
        raise LinkError(
            f"{self._words!r} is not there, found {here}"
            + (f" ({why})" if why else "")
            + "; see host find, or name its port with --link"
        )


def _matching(answers: list[Answer], words: str) -> list[Answer]:
    """Return the devices of an identity or, if there are none, of a name."""
    here = [answer for answer in answers if answer.outcome == "orb"]
    exact = [answer for answer in here if answer.device_id == words]
    return exact or [answer for answer in here if answer.name == words]
