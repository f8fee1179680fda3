"""Sounds, computed from a few numbers each, at the volumes that the player chose.

The mixer opens in a thread, because some systems take seconds to say that there is no audio
device. Until it is open, and where there is none, playing is quietly nothing.
"""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from threading import Thread
from typing import Final

import numpy as np
import pygame
from numpy.typing import NDArray

from tetris.kit.settings import Settings

_CHANNELS: Final = 16
_BUFFER: Final = 512  # samples: 12 ms, so that a sound belongs to its key
RATE_HZ: Final = 44_100
Wave = NDArray[np.float64]  # (samples,), -1 to 1

_ATTACK_S: Final = 0.003  # shorter would click
_RELEASE_S: Final = 0.012
_LOUDEST: Final = 0.8


@dataclass(frozen=True, slots=True)
class Note:
    """One note: a frequency with its overtones, which dies away."""

    hz: float  # 0 is noise
    start_s: float = 0.0
    lasts_s: float = 0.15
    loud: float = 0.5  # from 0 to 1
    fade: float = 5.0  # how fast it dies away, by this power of e while it lasts
    glide: float = 1.0  # by what its frequency is multiplied by the time it ends
    bright: float = 0.35  # how strong its overtones are, 0 to 1


def _load() -> Iterator[tuple[str, list[Note]]]:
    """Yield the sounds of the file by name, each with its notes."""
    file = files("assets") / "tetris" / "sounds.toml"
    for name, groups in tomllib.loads(file.read_text("utf-8")).items():
        notes = []
        for group in groups:
            start_s, step_s = group.pop("start_s", 0.0), group.pop("step_s", 0.0)
            steps = group.pop("semitones", ())
            pitches_hz = [440.0 * 2.0 ** (step / 12) for step in steps] or [group.pop("hz")]
            for place, hz in enumerate(pitches_hz):
                notes.append(Note(hz, start_s + place * step_s, **group))
        yield name, notes


SOUNDS: Final[Mapping[str, Sequence[Note]]] = dict(_load())
"""By name."""

_OVERTONES: Final = ((1, 1.0), (2, 0.6), (3, 0.35), (4, 0.16))


def wave(notes: Sequence[Note]) -> Wave:
    """Return notes as samples at `RATE_HZ`."""
    length = max(round((note.start_s + note.lasts_s) * RATE_HZ) for note in notes)
    mixed = np.zeros(length)
    for note in notes:
        start = round(note.start_s * RATE_HZ)
        sound = _note(note)[: length - start]
        mixed[start : start + len(sound)] += sound
    loudest = float(np.abs(mixed).max())
    return mixed * (_LOUDEST / loudest) if loudest > _LOUDEST else mixed


def pcm(notes: Sequence[Note]) -> bytes:
    """Return notes as signed 16-bit stereo, the way pygame's mixer wants them."""
    samples = np.round(wave(notes) * 32767).astype("<i2")
    return np.repeat(samples, 2).tobytes()


def _note(note: Note) -> Wave:
    count = round(note.lasts_s * RATE_HZ)
    share = np.arange(count) / count
    if note.hz:
        sweep = note.hz * note.glide**share
        phase = 2 * np.pi * np.cumsum(sweep) / RATE_HZ
        sound = sum(
            (strength if order == 1 else strength * note.bright) * np.sin(order * phase)
            for order, strength in _OVERTONES
        )
    else:
        sound = np.random.default_rng(1).uniform(-1, 1, count)
    fading = np.exp(-note.fade * share) * np.minimum(1, share * note.lasts_s / _ATTACK_S)
    ending = np.minimum(1, (1 - share) * note.lasts_s / _RELEASE_S)
    return np.asarray(note.loud * sound * fading * ending, np.float64)


# -- playing them ------------------------------------------------------------------------------


class Sounds:
    """Plays sounds. All methods return at once."""

    def __init__(self) -> None:
        self._ready: Mapping[str, pygame.mixer.Sound] = {}
        self._peaks: Mapping[pygame.mixer.Sound, float] = {}  # greatest samples, 0 to 1
        self._volumes = {"effects": 0.0, "clicks": 0.0}
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
        try:
            pygame.mixer.init(RATE_HZ, -16, 2, _BUFFER, allowedchanges=0)
            pygame.mixer.set_num_channels(_CHANNELS)
            sounds = {name: pygame.mixer.Sound(buffer=pcm(notes)) for name, notes in SOUNDS.items()}
        except (pygame.error, NotImplementedError):
            return  # no audio device: a silent game is as good a game
        self._peaks = {
            sound: float(np.abs(wave(SOUNDS[name])).max()) for name, sound in sounds.items()
        }
        self._ready = sounds

    def set_volumes(self, settings: Settings) -> None:
        """Take over the volumes that the player chose."""
        for kind in self._volumes:
            # Loudness is felt by its square, so that half way sounds half as loud.
            self._volumes[kind] = (getattr(settings, kind) / 100) ** 2

    def play(self, name: str, kind: str) -> None:
        """Play a sound at the volume of its kind; softer where all together would be too loud."""
        sound, volume = self._ready.get(name), self._volumes[kind]
        if sound is None or volume <= 0 or not pygame.mixer.get_init():
            return
        room = 1.0 - sum(
            channel.get_volume() * self._peaks[playing]
            for channel in map(pygame.mixer.Channel, range(_CHANNELS))
            if (playing := channel.get_sound())
        )
        volume = min(volume, room / self._peaks[sound])
        if volume > 0 and (channel := sound.play()):
            channel.set_volume(volume)
