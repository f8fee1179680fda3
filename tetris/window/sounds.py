"""Sounds for events, at the volumes that the player chose.

The mixer opens in a thread, because some systems take seconds to say that there is no audio
device. Until it is open, and where there is none, playing is quietly nothing.
"""

import os
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from threading import Thread
from typing import Final

import pygame

from tetris.engine import events as happened
from tetris.engine.events import Action, Event, Finish
from tetris.engine.moves import Spin
from tetris.engine.scoring import Clear
from tetris.window import synth
from tetris.window.settings import Settings

_MOVES: Final[Mapping[Action, str]] = {Action.LEFT: "shift", Action.RIGHT: "shift"}
_LINES: Final = ("", "single", "double", "triple", "tetris")
_CHANNELS: Final = 16
_BUFFER: Final = 512  # samples: 12 ms, so that a sound belongs to its key


class Sounds:
    """Plays sounds. All methods return at once."""

    def __init__(self) -> None:
        self._ready: Mapping[str, pygame.mixer.Sound] = {}
        self._volumes = {"effects": 0.0, "clicks": 0.0, "tones": 0.0}
        self._opening: Thread | None = None

    def start(self) -> None:
        """Begin to open the audio device."""
        self._opening = Thread(target=self._open, name="audio", daemon=True)
        self._opening.start()

    def stop(self) -> None:
        """Wait until the device is open, so that pygame can close it."""
        if self._opening:
            self._opening.join(timeout=2.0)
        self._ready = {}

    def _open(self) -> None:
        if not device_likely():
            return
        try:
            pygame.mixer.init(synth.RATE_HZ, -16, 2, _BUFFER, allowedchanges=0)
            pygame.mixer.set_num_channels(_CHANNELS)
            sounds = {
                name: pygame.mixer.Sound(buffer=synth.pcm(notes))
                for name, notes in synth.SOUNDS.items()
            }
        except (pygame.error, NotImplementedError):
            return  # no audio device: a silent game is as good a game
        self._ready = sounds

    def set_volumes(self, settings: Settings) -> None:
        """Take over the volumes that the player chose."""
        for kind in self._volumes:
            # Loudness is felt by its square, so that half way sounds half as loud.
            self._volumes[kind] = (getattr(settings, kind) / 100) ** 2

    def click(self, name: str) -> None:
        """Play one of the menus' sounds: move, take or back."""
        self._play(f"menu_{name}", "clicks")

    def effect(self, name: str) -> None:
        """Play one of the game's sounds by its name."""
        self._play(name, "effects")

    def show(self, events: Iterable[Event]) -> None:
        """Play what events sound like."""
        for event in events:
            match event:
                case happened.Spawned(piece=piece):
                    self._play(f"tone_{piece.kind}", "tones")
                case _ if name := sound_of(event):
                    self._play(name, "effects")

    def _play(self, name: str, kind: str) -> None:
        sound, volume = self._ready.get(name), self._volumes[kind]
        if sound is None or volume <= 0 or not pygame.mixer.get_init():
            return
        sound.set_volume(volume)
        sound.play()


def device_likely(system: str = sys.platform, root: Path = Path("/")) -> bool:
    """Return False where there can be no audio device; asking ALSA would fill the terminal.

    Args:
        system: As `sys.platform`; only Linux is looked at.
        root: The root of the file system.
    """
    if system != "linux" or os.environ.get("SDL_AUDIODRIVER") or os.environ.get("PULSE_SERVER"):
        return True
    runtime = root / os.environ.get("XDG_RUNTIME_DIR", "run/user/0").lstrip("/")
    servers = (runtime / "pulse" / "native", runtime / "pipewire-0")
    return any(server.exists() for server in servers) or any((root / "dev/snd").glob("pcm*"))


def sound_of(event: Event) -> str:
    """Return the name of the sound of an event, "" for silent ones."""
    match event:
        case happened.Moved(action=action) if action:
            return _MOVES.get(action, "")
        case happened.Rotated():
            return "rotate"
        case happened.Held():
            return "hold"
        case happened.Dropped():
            return "drop"
        case happened.Locked(clear=clear):
            return _clear_sound(clear)
        case happened.LevelUp():
            return "level"
        case happened.ToppedOut():
            return "over"
        case happened.Finished(reason=reason):
            return "won" if reason in (Finish.GOAL, Finish.TIME) else "over"
        case happened.Undone():
            return "undo"
    return ""


def _clear_sound(clear: Clear) -> str:
    if clear.perfect:
        return "perfect"
    if clear.spin is not Spin.NONE:
        return "spin" if clear.spin is Spin.FULL else "mini"
    return _LINES[clear.lines] or "lock"
