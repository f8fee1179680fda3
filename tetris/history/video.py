"""Video files: pictures one after another into a GIF or an MP4 file.

Needs the `film` extra: Pillow for GIF, PyAV for MP4. Pictures are written as they come, so
that a long film takes no more memory than a short one.
"""

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Final, Protocol, Self

from tetris.files import check_replaceable

Size = tuple[int, int]  # pixels
Picture = bytes  # RGB, row by row from the top
SUFFIXES: Final = (".gif", ".mp4")
_COLOURS: Final = 256
_CENTISECOND: Final = 100  # GIF counts time in these
_GIF_END: Final = b"\x3b"
_ROUND_AND_ROUND: Final = b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00"
_MP4_CRF: Final = "20"  # x264's quality: smaller is better, 18 to 24 is usual


class VideoError(RuntimeError):
    """A film cannot be made; the message is one sentence."""


class Video(Protocol):
    """A film that is being written."""

    def add(self, picture: Picture) -> None:
        """Add a picture."""

    def close(self) -> None:
        """Write what is left; the file is complete afterwards."""


class VideoFile:
    """A film beside its place; it comes there when it is complete, and else leaves nothing."""

    def __init__(self, path: Path, size: Size, rate_hz: int, sample: Sequence[Picture]) -> None:
        """Begin a film.

        Args:
            path: Its file; the suffix, `.gif` or `.mp4`, is its kind.
            size: Of the pictures, even numbers.
            rate_hz: Pictures a second.
            sample: Some of the pictures to come, from which a GIF takes its 256 colours.

        Raises:
            VideoError: The suffix is another, or the library is missing.
            OSError: The file cannot be written.
        """
        check_replaceable(path)
        self._path = path
        self._beside = path.with_name(f".{path.stem}.part{path.suffix}")
        suffix = path.suffix.lower()
        self._film: Video
        if suffix == ".gif":
            self._film = _Gif(self._beside, size, rate_hz, sample)
        elif suffix == ".mp4":
            self._film = _Mp4(self._beside, size, rate_hz)
        else:
            raise VideoError(f"a film is a .gif or a .mp4 file, not {path.name}")

    def add(self, picture: Picture) -> None:
        """Add a picture."""
        self._film.add(picture)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Put the film in its place, or take it away where it could not be completed."""
        try:
            self._film.close()
            if error is None:
                self._beside.replace(self._path)
        finally:
            self._beside.unlink(missing_ok=True)


class _Gif:
    """One palette for the whole film; of each picture only what differs from the one before."""

    def __init__(self, path: Path, size: Size, rate_hz: int, sample: Sequence[Picture]) -> None:
        try:
            from PIL import GifImagePlugin, Image, ImageChops
        except ImportError as error:
            raise _missing("GIF", "Pillow") from error
        self._image, self._chops, self._plugin = Image, ImageChops, GifImagePlugin
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

    def add(self, picture: Picture) -> None:
        image = self._image.frombytes("RGB", self._size, picture)
        drawn = image.quantize(palette=self._palette, dither=self._image.Dither.NONE)
        box = (0, 0, *self._size)
        if self._before is not None:
            changed = self._chops.difference(drawn.convert("RGB"), self._before.convert("RGB"))
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
        data = self._plugin.getdata(image, offset, duration=10 * min(end - start, most))
        self._file.write(b"".join(data))
        self._waiting = None


class _Mp4:
    def __init__(self, path: Path, size: Size, rate_hz: int) -> None:
        try:
            import av
            import numpy as np
        except ImportError as error:
            raise _missing("MP4", "PyAV") from error
        self._frame, self._np, self._size = av.VideoFrame, np, size
        self._container: Any = av.open(str(path), "w")
        self._stream = self._container.add_stream("h264", rate=rate_hz)
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = "yuv420p"
        self._stream.options = {"crf": _MP4_CRF, "movflags": "faststart"}

    def add(self, picture: Picture) -> None:
        width, height = self._size
        pixels = self._np.frombuffer(picture, self._np.uint8).reshape(height, width, 3)
        frame = self._frame.from_ndarray(pixels, format="rgb24")
        self._container.mux(self._stream.encode(frame))

    def close(self) -> None:
        self._container.mux(self._stream.encode())
        self._container.close()


def _missing(kind: str, library: str) -> VideoError:
    return VideoError(
        f"{library}, which writes {kind} films, is not installed; pip install 'orbtouch[film]'"
    )
