"""Defaults of known devices: target and mapping that `host --device` last played with."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from host.connection.device_store import DeviceStore
from host.connection.discovery import DevicePort, now
from host.connection.receiver import Connected, Received
from host.targets import Target

_USUAL: Final = "tetris"


def seek(options: argparse.Namespace, memory: DeviceStore) -> DevicePort | None:
    """Look for the device that --device names, or raise LinkError; fill in what it played last.

    What the command line names counts; the mapping and the profile of the past belong to the
    target of the past.
    """
    if options.device is None:
        return None
    seeker = DevicePort(options.device, memory, _path(options.key))
    [known] = memory.named(seeker.device_id)
    if options.key is None and known.key:
        options.key = Path(known.key)
    same = options.target in (None, known.target)
    options.target = options.target or known.target or _USUAL
    if same and options.mapping is None and known.keys:
        options.mapping = Path(known.keys)
    if same and options.profile is None and _path(options.mapping) == known.keys:
        options.profile = known.profile
    return seeker


class DeviceDefaults:
    """Remembers the device that connects, and at the end the profile that it was left in."""

    def __init__(
        self,
        memory: DeviceStore,
        options: argparse.Namespace,
        target: Target,
        seeker: DevicePort | None = None,
    ) -> None:
        """Take what was chosen, and what is played.

        `options` are complete; `seeker` knows the port, where --device named the orb.
        """
        self._memory, self._options, self._target = memory, options, target
        self._seeker = self._named = seeker
        self._device_id = ""

    def on_received(self, received: Sequence[Received]) -> None:
        """Note the device that has connected, and its port; LinkError if it is another one."""
        if self._named is not None:
            self._named.on_received(received)
        for news in received:
            at = self._seeker.url if self._seeker else self._options.link
            if isinstance(news, Connected) and news.welcome.device_id and at:
                self._device_id = news.welcome.device_id
                self._memory.remember(
                    self._device_id,
                    name=news.welcome.name,
                    virtual=news.welcome.virtual,
                    port=at,
                    seen=now(),
                    target=self._options.target,
                    keys=_path(self._options.mapping),
                    key=_path(self._options.key),
                )

    def moved(self, seeker: DevicePort | None, key: str) -> None:
        """Note the orb that is chosen while the program runs; None: our own, which is not noted."""
        self.close()
        self._device_id, self._seeker, self._named = "", seeker, None
        self._options.link, self._options.key = None, Path(key) if key else None

    def close(self) -> None:
        """Note how it was left."""
        if self._device_id:
            self._memory.remember(self._device_id, profile=self._target.profile)


def _path(path: Path | None) -> str:
    """Return where a file is, from wherever the next command is typed."""
    return str(path.resolve()) if path else ""
