"""Pending examples of gestures on disk: taken over the link, and not learned yet."""

import contextlib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from controller.adapt import lessons
from controller.adapt.examples import LEAD_S, TAIL_S, Example, guess_symmetries
from controller.recognition.images.frames import Image
from controller.remote.worker import Worker
from controller.runtime.device import Device
from controller.runtime.loop import Handler
from controller.shared import files, npz
from controller.shared.aliases import Images
from controller.shared.cues import NULL_LABEL
from controller.shared.errors import UserError, reason
from controller.shared.notices import notice
from controller.shared.protocol.codec import quantise_image
from controller.shared.protocol.messages import Message
from controller.shared.protocol.teaching import (
    MOST_PIXELS,
    ExampleDrop,
    ExampleEnd,
    ExampleStart,
    ExampleTaken,
)

MOST: Final = 60  # pending examples
MOST_S: Final = 10.0  # of one
FELT: Final = 0.04  # greatest change of a taxel, z, below which nothing touched the orb
_MAX_BYTES: Final = 4 << 20  # of a file
_LABEL: Final = re.compile(r"[a-z][a-z0-9_]{0,39}")
_FILE: Final = re.compile(r"example-(\d{1,10})\.npz")


class ExampleError(UserError, ValueError):
    """An example cannot be taken; the message is one sentence with the reason."""


@dataclass(frozen=True, eq=False)
class PendingExample:
    """One example with its number."""

    number: int
    example: Example  # with its span
    rate_hz: float

    def report(self, guess: tuple[str, bool]) -> ExampleTaken:
        """Return the message about it, with the guess of its gesture's symmetries."""
        span = self.example.span or (0.0, 0.0)
        seconds = round(float(span[1] - span[0]) / self.rate_hz, 3)
        image = image_bytes(firmest(self.example))
        return ExampleTaken(self.number, self.example.label, True, "", seconds, image, *guess)


def taken(number: int, label: str, images: Images, rate_hz: float) -> PendingExample:
    """Return the example in images, (frames, rows, columns); ExampleError if there is none."""
    one = Example(label, images)
    if len(images) < 3:
        raise ExampleError(notice("not_ready"))
    if label == NULL_LABEL:
        whole = replace(one, span=(0.0, float(len(images))))
        return PendingExample(number, whole, rate_hz)
    if float(np.abs(images - np.median(images, axis=0)).max()) < FELT:
        raise ExampleError(notice("untouched"))
    found = one.found(rate_hz)
    if found is None:
        raise ExampleError(notice("too_weak"))
    return PendingExample(number, found, rate_hz)


def firmest(example: Example) -> Images:
    """Return the image of an example's touch at its firmest, (rows, columns)."""
    first, end = example.span or (0.0, float(len(example.images)))
    touch = example.images[int(first) : max(int(first) + 1, int(np.ceil(end)))]
    image: Images = touch[np.abs(touch - 1.0).mean(axis=(1, 2)).argmax()]
    return image


def image_bytes(image: Images) -> bytes:
    """Return an image, (rows, columns), for a message; b"" if it is too large for one."""
    return quantise_image(image.ravel().tolist()) if image.size <= MOST_PIXELS else b""


class ExampleStore:
    """A folder of pending examples, which need not exist; a file for each."""

    def __init__(self, folder: Path, grid: tuple[int, int], rate_hz: float) -> None:
        """Read the examples there; files for another grid (rows, columns) are left alone."""
        self.folder, self._grid, self._rate_hz = folder, grid, rate_hz
        self.pending: dict[int, PendingExample] = {}
        files.sweep(folder)
        with contextlib.suppress(OSError):
            for path in sorted(folder.iterdir()):
                self._read(path)

    def keep(self, one: PendingExample) -> None:
        """Write an example to the disk; ExampleError if there is no room for it."""
        if len(self.pending) >= MOST:
            raise ExampleError(notice("many_waiting", MOST))
        arrays = lessons.pack([one.example], self._grid)
        try:
            files.atomic_write(self._path(one.number), npz.pack(arrays), private=True)
        except OSError as error:
            raise ExampleError(notice("cannot_keep", reason(error))) from None
        self.pending[one.number] = one

    def drop(self, numbers: list[int]) -> int:
        """Delete examples, and return how many of them there were."""
        count = 0
        for number in numbers:
            if self.pending.pop(number, None) is not None:
                self._path(number).unlink(missing_ok=True)
                count += 1
        return count

    def delete(self) -> int:
        """Delete all examples, of other grids too, and what a crash left; return the number."""
        self.pending.clear()
        files.sweep(self.folder, age_s=0.0)
        found = [path for path in self.folder.glob("*") if _FILE.fullmatch(path.name)]
        for path in found:
            path.unlink(missing_ok=True)
        return len(found)

    def of(self, label: str) -> list[PendingExample]:
        """Return the pending examples of a label, in the order of their numbers."""
        found = (one for one in self.pending.values() if one.example.label == label)
        return sorted(found, key=lambda one: one.number)

    def report(self, one: PendingExample) -> ExampleTaken:
        """Return the message about an example, with the symmetries of all of its label."""
        return one.report(guess_symmetries([each.example for each in self.of(one.example.label)]))

    def _path(self, number: int) -> Path:
        return self.folder / f"example-{number}.npz"

    def _read(self, path: Path) -> None:
        """Read one file, if it is an example."""
        match = _FILE.fullmatch(path.name)
        if match is None or len(self.pending) >= MOST:
            return
        with contextlib.suppress(OSError, npz.ZipError, ValueError):
            arrays = npz.unpack(path, _MAX_BYTES)
            if lessons.fits(arrays, self._grid):
                (example,) = lessons.unpack(arrays)
                number = int(match[1])
                self.pending[number] = PendingExample(number, example, self._rate_hz)


@dataclass(slots=True)
class _Open:
    """An example under way."""

    number: int
    label: str
    device: Device
    first: int  # number of its first image
    end: int | None = None  # and the one after its last; None: it has not ended


class ExampleTaker(Handler):
    """Cuts the host's examples from the images of a device, and has a worker keep them."""

    def __init__(self, store: ExampleStore, worker: Worker) -> None:
        self._store, self._worker = store, worker
        self._open: _Open | None = None

    def take(self, message: Message, device: Device) -> Sequence[Message] | None:
        """Begin, end or drop an example."""
        match message:
            case ExampleStart():
                return self._start(message, device)
            case ExampleDrop():
                return self._worker.begin(partial(self._drop, message.number))
            case ExampleEnd():
                if self._open is not None and self._open.number == message.number:
                    self._open.end = device.image_count
                    self._open = self._open if message.keep else None
                return []
        return None

    def poll(self, device: Device) -> Sequence[Message]:
        """Have an example kept once all of its images are there."""
        one = self._open
        if one is None:
            return []
        rate_hz = device.sensor.rate_hz
        last = one.end if one.end is not None else one.first + round((LEAD_S + MOST_S) * rate_hz)
        if one.device is device and device.image_count < last + round(TAIL_S * rate_hz):
            return []
        self._open = None
        if one.device is not device:
            return [untaken(one.number, one.label, notice("anew"))]
        if one.end is None:
            return [untaken(one.number, one.label, notice("too_long", MOST_S))]
        images = device.images(one.first, device.image_count)
        slow = untaken(one.number, one.label, notice("slow_disk"))
        return self._worker.begin(partial(self._keep, one, images, rate_hz), slow)

    def _start(self, message: ExampleStart, device: Device) -> list[Message]:
        if message.number in self._store.pending:
            why = notice("number_taken", message.number)
            return [untaken(message.number, message.label, why)]
        if not _LABEL.fullmatch(message.label):
            return [untaken(message.number, message.label, notice("no_label", message.label))]
        first = device.image_count - round(LEAD_S * device.sensor.rate_hz)
        self._open = _Open(message.number, message.label, device, first)
        return []

    def _keep(self, one: _Open, images: list[Image], rate_hz: float) -> Iterable[Message]:
        """Keep an example on the disk, and return its report."""
        try:
            stack = np.array(images, dtype=np.float32)
            pending = taken(one.number, one.label, stack, rate_hz)
            self._store.keep(pending)
        except ExampleError as error:
            return [untaken(one.number, one.label, str(error))]
        return [self._store.report(pending)]

    def _drop(self, number: int) -> Iterable[Message]:
        self._store.drop([number])
        return []


def untaken(number: int, label: str, why: str) -> Message:
    """Return the report of an example that was not taken, for a reason."""
    return ExampleTaken(number, label, False, why, 0.0, b"")
