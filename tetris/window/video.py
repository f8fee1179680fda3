"""Export of a replay as a GIF or an MP4 file, drawn off screen.

Needs the `film` extra: Pillow for GIF, PyAV for MP4. Pictures are written as they come, so
that a long film takes no more memory than a short one.
"""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, Final

import pygame

from tetris.engine.game import Phase
from tetris.files import check_replaceable
from tetris.history.replay import Player, Replay
from tetris.window.tiles import ThemeChoice
from tetris.window.view import GameView

Size = tuple[int, int]  # pixels
Picture = bytes  # RGB, row by row from the top
SIZE: Final[Size] = (640, 576)  # pixels
GIF_RATE_HZ: Final = 20  # pictures a second
MP4_RATE_HZ: Final = 30
_REST_S: Final = 2.0  # how long the last picture stays
_SAMPLES: Final = 9  # pictures from which a GIF takes its colours
_STEPS: Final = 2  # pictures a frame of the window, about 10 ms each
_COLOURS: Final = 256
_CENTISECOND: Final = 100  # GIF counts time in these
_GIF_END: Final = b"\x3b"
_ROUND_AND_ROUND: Final = b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00"
_MP4_CRF: Final = "20"  # x264's quality: smaller is better, 18 to 24 is usual


class VideoError(RuntimeError):
    """A film cannot be made; the message is one sentence."""


@contextmanager
def video_file(
    path: Path, size: Size, rate_hz: int, sample: Sequence[Picture]
) -> Iterator["_Gif | _Mp4"]:
    """Write a film of pictures of even sides beside its place; it comes there when complete.

    A GIF takes its 256 colours from the sample.
    """
    check_replaceable(path)
    beside = path.with_name(f".{path.stem}.part{path.suffix}")
    kinds: dict[str, type[_Gif | _Mp4]] = {".gif": _Gif, ".mp4": _Mp4}
    kind = kinds.get(path.suffix.lower())
    if kind is None:
        raise VideoError(f"a film is a .gif or a .mp4 file, not {path.name}")
    film = kind(beside, size, rate_hz, sample)
    try:
        try:
            yield film
        finally:
            film.close()
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


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
    def __init__(self, path: Path, size: Size, rate_hz: int, _: Sequence[Picture]) -> None:
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


# -- the pictures ------------------------------------------------------------------------------


def export(
    replay: Replay,
    path: Path,
    *,
    size: Size = SIZE,
    speed: float = 1.0,
    look: ThemeChoice | None = None,
) -> Iterator[float]:
    """Save a replay as a film, and yield the share that is done, 0 to 1, picture by picture.

    Pauses are left out. Stop asking, and there is no film.

    Raises:
        VideoError: The kind of file is unknown, or its library is not installed.
        OSError: The file cannot be written.
    """
    rate_hz = GIF_RATE_HZ if path.suffix.lower() == ".gif" else MP4_RATE_HZ
    surface, view = pygame.Surface(size), GameView(pygame.Rect((0, 0), size), look=look)
    sample = _sample(replay, surface, view)
    player = Player(replay)
    view = GameView(pygame.Rect((0, 0), size), look=look)
    view.show(player.first_events)
    end_s = player.end_s + _REST_S * speed
    time_s = player.start_s
    with video_file(path, size, rate_hz, sample) as film:
        while time_s <= end_s:
            view.show(player.advance(time_s))
            if player.game.phase is Phase.PAUSED and not player.at_end:
                time_s = max(time_s, player.next_s)
                view.show(player.advance(time_s))
            film.add(_drawn(surface, view, player, time_s))
            yield min(1.0, (time_s - player.start_s) / (end_s - player.start_s))
            time_s += speed / rate_hz


def unseen() -> None:
    """Prepare pygame for drawing in a program that opens no window."""
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    pygame.display.init()
    pygame.font.init()
    pygame.display.set_mode((1, 1))


def _sample(replay: Replay, surface: pygame.Surface, view: GameView) -> list[Picture]:
    """Return pictures from all over the replay."""
    player = Player(replay)
    pictures = []
    for number in range(_SAMPLES):
        time_s = player.start_s + player.duration_s * (number + 0.5) / _SAMPLES
        view.show(player.advance(time_s))
        pictures.append(_drawn(surface, view, player, time_s))
    return pictures


def _drawn(surface: pygame.Surface, view: GameView, player: Player, time_s: float) -> Picture:
    view.draw(surface, player.game, time_s)
    return pygame.image.tobytes(surface, "RGB")


class VideoExport:
    """Export beside the window: a few pictures with every frame."""

    def __init__(self, replay: Replay, path: Path, look: ThemeChoice) -> None:
        self.path, self.share = path, 0.0  # how much of it is done, 0 to 1
        self.trouble = ""  # a sentence if it cannot be made
        self.going_on = True
        self._steps = export(replay, path, look=look)

    def step(self) -> None:
        """Go on a little."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            shares = list(islice(self._steps, _STEPS))
            self.going_on, self.share = len(shares) == _STEPS, max(self.share, *shares, 0.0)
        except (VideoError, OSError) as error:
            self.trouble, self.going_on = str(error), False
