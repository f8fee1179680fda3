"""An animated GIF of pictures, written as they come."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO, Final

from PIL import GifImagePlugin, Image, ImageChops

_COLOURS: Final = 256
_CENTISECOND: Final = 100  # GIF counts time in these
_GIF_END: Final = b"\x3b"
_ROUND_AND_ROUND: Final = b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00"


class GifFile:
    """One palette for the whole film; of each picture only what differs from the one before."""

    def __init__(
        self, path: Path, size: tuple[int, int], rate_hz: int, sample: Sequence[bytes]
    ) -> None:
        self._size, self._rate_hz = size, rate_hz
        strip = Image.new("RGB", (size[0], size[1] * len(sample)))
        for number, picture in enumerate(sample):
            strip.paste(Image.frombytes("RGB", size, picture), (0, size[1] * number))
        self._palette = strip.quantize(_COLOURS)
        colours = bytes(self._palette.getpalette() or ())[: 3 * _COLOURS]
        self._file: BinaryIO = path.open("wb")
        width, height = (side.to_bytes(2, "little") for side in size)
        self._file.write(b"GIF89a" + width + height + b"\xf7\x00\x00")
        self._file.write(colours.ljust(3 * _COLOURS, b"\x00") + _ROUND_AND_ROUND)
        self._before: Any = None  # the picture that the next one is compared with
        self._waiting: tuple[Any, tuple[int, int]] | None = None  # until its length is known
        self._number = self._since = 0

    def add(self, picture: bytes) -> None:
        image = Image.frombytes("RGB", self._size, picture)
        drawn = image.quantize(palette=self._palette, dither=Image.Dither.NONE)
        box = (0, 0, *self._size)
        if self._before is not None:
            changed = ImageChops.difference(drawn.convert("RGB"), self._before.convert("RGB"))
            box = changed.getbbox() or (0, 0, 0, 0)
        if box[2]:
            self._flush()
            self._waiting = drawn.crop(box), (box[0], box[1])
            self._since, self._before = self._number, drawn
        self._number += 1

    def close(self) -> None:
        self._flush()
        self._file.write(_GIF_END)
        self._file.close()

    def _flush(self) -> None:
        """Write the last picture, which lasts until now."""
        if self._waiting is None:
            return
        image, offset = self._waiting
        start, end = (n * _CENTISECOND // self._rate_hz for n in (self._since, self._number))
        most = 65_535  # centiseconds, two bytes
        data = GifImagePlugin.getdata(image, offset, duration=10 * min(end - start, most))
        self._file.write(b"".join(data))
        self._waiting = None
