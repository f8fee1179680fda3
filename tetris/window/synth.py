"""Sounds computed from a few numbers each: struck strings, noise, glides. Pure.

A sound is made of notes; a note is a frequency in hertz with its overtones, which dies away.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

RATE_HZ: Final = 44_100
Wave = NDArray[np.float64]  # (samples,), -1 to 1

_ATTACK_S: Final = 0.003  # shorter would click
_RELEASE_S: Final = 0.012
_LOUDEST: Final = 0.8


@dataclass(frozen=True, slots=True)
class Note:
    """One note.

    Attributes:
        hz: Its frequency; 0 is noise.
        start_s: When it begins.
        lasts_s: How long it is heard.
        loud: From 0 to 1.
        fade: How fast it dies away, by this power of e while it lasts.
        glide: By what its frequency is multiplied by the time it ends.
        bright: How strong its overtones are, 0 to 1.
    """

    hz: float
    start_s: float = 0.0
    lasts_s: float = 0.15
    loud: float = 0.5
    fade: float = 5.0
    glide: float = 1.0
    bright: float = 0.35


def _pitch(semitones: int) -> float:
    """Return a frequency so many semitones above A4."""
    return 440.0 * float(2.0 ** (semitones / 12))


def _chime(
    semitones: Sequence[int], step_s: float, lasts_s: float, loud: float = 0.42
) -> list[Note]:
    """Return notes that follow each other and ring on."""
    return [
        Note(_pitch(semitone), place * step_s, lasts_s, loud, 4.5, bright=0.25)
        for place, semitone in enumerate(semitones)
    ]


# A pentatonic scale: whatever follows whatever, it never sounds wrong.
SOUNDS: Final[Mapping[str, Sequence[Note]]] = {
    "shift": [Note(_pitch(3), 0, 0.035, 0.16, 6, bright=0.1)],
    "rotate": [Note(_pitch(10), 0, 0.05, 0.2, 5, glide=1.12, bright=0.15)],
    "hold": [Note(_pitch(0), 0, 0.07, 0.25, 5), Note(_pitch(7), 0.05, 0.09, 0.25, 5)],
    "lock": [Note(110, 0, 0.09, 0.5, 6, glide=0.6, bright=0.1), Note(0, 0, 0.025, 0.12, 6)],
    "drop": [Note(82, 0, 0.13, 0.75, 6, glide=0.5, bright=0.1), Note(0, 0, 0.05, 0.3, 7)],
    "single": _chime([0, 7], 0.05, 0.28),
    "double": _chime([0, 5, 7], 0.05, 0.32),
    "triple": _chime([0, 5, 7, 12], 0.05, 0.36),
    "tetris": _chime([0, 5, 7, 12, 17, 19], 0.055, 0.55, 0.46),
    "spin": _chime([-5, 2, 9, 14], 0.06, 0.5, 0.46),
    "mini": _chime([2, 9], 0.05, 0.3),
    "perfect": _chime([0, 4, 7, 12, 16, 19, 24], 0.07, 0.8, 0.46),
    "level": _chime([0, 4, 7, 12], 0.09, 0.45),
    "over": [
        Note(_pitch(semitone), place * 0.16, 0.5, 0.45, 4, glide=0.97)
        for place, semitone in enumerate([0, -3, -7, -12])
    ],
    "won": _chime([0, 7, 12, 16, 19, 24], 0.09, 0.9, 0.46),
    "ready": [Note(_pitch(-5), 0, 0.12, 0.35, 5)],
    "undo": [Note(_pitch(7), 0, 0.08, 0.3, 5), Note(_pitch(0), 0.06, 0.1, 0.3, 5)],
    "menu_move": [Note(_pitch(7), 0, 0.03, 0.25, 6, bright=0.1)],
    "menu_take": [Note(_pitch(0), 0, 0.07, 0.3, 5), Note(_pitch(7), 0.04, 0.12, 0.3, 5)],
    "menu_back": [Note(_pitch(7), 0, 0.06, 0.28, 5), Note(_pitch(0), 0.04, 0.1, 0.28, 5)],
    # A tone per piece: two octaves of the scale, so that each is known by ear.
    "tone_I": [Note(_pitch(-9), 0, 0.3, 0.5, 4)],
    "tone_O": [Note(_pitch(-7), 0, 0.3, 0.5, 4)],
    "tone_T": [Note(_pitch(-5), 0, 0.3, 0.5, 4)],
    "tone_S": [Note(_pitch(-2), 0, 0.3, 0.45, 4)],
    "tone_Z": [Note(_pitch(0), 0, 0.3, 0.45, 4)],
    "tone_J": [Note(_pitch(3), 0, 0.3, 0.4, 4)],
    "tone_L": [Note(_pitch(5), 0, 0.3, 0.4, 4)],
}
"""By name; all are made for this program and belong to it."""

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
