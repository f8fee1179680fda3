"""Live play of any predictor: the device's stages in this program, with the predictor inside."""

import itertools
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.images.frames import Window
from controller.runtime.assemble import RunOptions, open_device, prepare
from controller.runtime.loop import Loop
from controller.shared.errors import UserError, one_line
from host.connection.receiver import Receiver
from host.connection.transport import open_transport
from orbtouch import checks
from orbtouch.evaluation import Predict, checked
from orbtouch.networks import Base, Command, Network, network_of
from orbtouch.onnx_files import renamed
from orbtouch.orbs import Orb, Press, Release

END_S: Final = 2.0  # for the loop to end
_Given = tuple[Network | Predict, Sequence[str], Base]  # predictor, its classes, and `base`
_LATE: Final = 20  # calls in a row that may last longer than a frame


class _Judge(Recognizer):
    """Networks of a bundle whose gestures are those of a predictor."""

    def __init__(self, bundle: Bundle, predict: Predict, order: Sequence[int]) -> None:
        super().__init__(bundle)
        self.problem = ""
        self._predict, self._order = predict, [*order]
        self._classes = [bundle.labels[at] for at in np.argsort(order)]
        self._frame_s, self._late = 1.0 / bundle.rate_hz, 0

    def probabilities(self, window: Window, user: str = "") -> NDArray[np.float32]:
        """Return the predictor's answer, (classes,); "null" for certain once it has failed."""
        certain: NDArray[np.float32] = np.eye(1, len(self._order), dtype=np.float32)[0]
        if self.problem:
            return certain
        before_s = time.monotonic()
        try:
            given = checked(self._predict, window[None], self._classes)[0]
        except UserError as error:
            self.problem = one_line(str(error))
            return certain
        took_s = time.monotonic() - before_s
        self._late = self._late + 1 if took_s > self._frame_s else 0
        if self._late == _LATE:
            self.problem = (
                f"the predictor takes {took_s * 1000:.0f} ms for a window, longer than a frame of "
                f"{self._frame_s * 1000:.0f} ms; make it faster, or take a slower `base`"
            )
        return certain if self.problem else given[self._order].astype(np.float32)


class _Server:
    """A device in a thread of this program; `thread` ends with a replay, or the predictor."""

    def __init__(
        self, given: tuple[Network | Predict, Sequence[str], Base], **options: Any
    ) -> None:
        predict, classes, base = given
        checks.options(options, ("sensor", "seed", "preset", "fault", "mapping", "replay"))
        for name in ("mapping", "replay"):
            if name in options:
                options[name] = checks.path(options[name])
        network = predict if isinstance(predict, Network) else network_of(base, "base")
        data, order = network._data, [*range(len(network.classes))]
        if not isinstance(predict, Network):
            if not callable(predict):
                raise UserError(f"{type(predict).__name__} is no network and cannot be called")
            data, order = renamed(data, classes or network.classes)
        if isinstance(options.get("fault"), str):
            options["fault"] = (options["fault"],)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "live.orb")
            path.write_bytes(data)
            self._parts = prepare(RunOptions(bundle=path, link="listen://127.0.0.1:0", **options))
        self._judge: _Judge | None = None
        if not isinstance(predict, Network):
            self._judge = _Judge(self._parts.bundle, predict, order)
            self._parts = replace(self._parts, recognizer=self._judge)
        self.url, self._problem, self._closed = self._parts.link.url, "", False
        self.thread = threading.Thread(target=self._run, name="live", daemon=True)
        self.thread.start()

    @property
    def problem(self) -> str:
        """Why it has ended; "" while it runs, and after a replay."""
        return self._problem or (self._judge.problem if self._judge else "")

    def close(self) -> None:
        """End the device."""
        self._closed = True
        self.thread.join(END_S)

    def _run(self) -> None:
        parts, numbers = self._parts, itertools.count(1)
        opened = (parts.link, lambda: open_device(parts, next(numbers)), time.monotonic)
        try:
            Loop(*opened, await_host=True).run(lambda: self._closed or bool(self.problem))
        except UserError as error:
            self._problem = str(error)
        finally:
            parts.link.close()


class _Live(Orb):
    """An orb whose device is in this program."""

    def __init__(self, server: _Server) -> None:
        super().__init__(Receiver(lambda: open_transport(server.url)), server.close)
        self._receiver.start()
        self._server = server

    def events(self) -> list[Press | Release | Command]:
        """Return what has happened, as `Orb.events`; Error if the predictor failed."""
        if self._server.problem:
            raise UserError(self._server.problem)
        events = super().events()
        if self.link == "lost" and not self._server.thread.is_alive():
            self.close()
        return events


def live(
    predict: Network | Predict,
    *,
    classes: Sequence[str] = (),
    base: Base = None,
    **options: Any,
) -> Orb:
    """Return an orb whose gestures are those of a predictor, in this program; close it at the end.

    Args:
        predict: Network, or callable that returns probabilities, (1, classes), for a window,
            (1, window, rows, columns), of images as of the device: 1.0 where untouched.
        classes: Names of the probabilities in their order, "null" among them; (): those of `base`.
        base: Source of the window, positions, thresholds and commands, or its file; None: as
            shipped.
        options: sensor="lines:port=/dev/ttyACM0", replay="own.npz", mapping="own.toml", seed=7,
            preset="paper-snr" or fault="dead:2,3", as of `controller`; by default a virtual orb.

    Raises:
        Error: An argument is unfit. `Orb.events` raises one if the predictor raises, takes longer
            than a frame all the time, or returns no probabilities.
    """
    return _Live(_Server((predict, classes, base), **options))


def play(
    predict: Network | Predict,
    *,
    classes: Sequence[str] = (),
    base: Base = None,
    words: Sequence[str] | str = (),
    **options: Any,
) -> int:
    """Play Tetris with a predictor until the window is closed; return the exit status of `host`.

    Args:
        predict: As of `live`.
        classes: As of `live`.
        base: As of `live`.
        words: Options of `host`, such as ("--target", "keyboard") or "--target keyboard".
        options: As of `live`.

    Raises:
        Error: As of `live`, once the window is closed.
    """
    from host.__main__ import main

    words = words.split() if isinstance(words, str) else words
    server = _Server((predict, classes, base), **options)
    try:
        status: int = main(["--link", server.url, *words])
    finally:
        server.close()
    if server.problem:
        raise UserError(server.problem)
    return status
