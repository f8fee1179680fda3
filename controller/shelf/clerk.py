"""Deliveries while the orb is played: the loop takes pieces, a thread proves, the loop switches."""

import threading
from collections.abc import Callable
from pathlib import Path

from controller.bundle import BundleError
from controller.protocol import DECLINED, IN_USE, Deliver, Delivery, Piece
from controller.shelf.intake import Intake

Install = Callable[[Path], str]  # proves a file and takes it into use; returns a sentence


class Clerk:
    """Sees to deliveries, and never keeps the loop waiting.

    Attributes:
        switched: Whether a new bundle is in use; the loop begins anew with it.
    """

    def __init__(self, intake: Intake, install: Install) -> None:
        """Take deliveries; `install` raises BundleError or OSError if it does not go through."""
        self.switched = False
        self._intake, self._install = intake, install
        self._thread: threading.Thread | None = None
        self._outcome: Delivery | None = None

    def take(self, message: Deliver | Piece) -> Delivery:
        """Return the answer to what a host says."""
        answer = self._intake.take(message)
        if self._intake.whole is not None and self._thread is None:
            path = self._intake.whole
            self._thread = threading.Thread(
                target=self._prove, args=(path,), name="clerk", daemon=True
            )
            self._thread.start()
        return answer

    def poll(self) -> Delivery | None:
        """Return how a proof went, once, without waiting."""
        if self._thread is None or self._thread.is_alive():
            return None
        self._thread = None
        self._intake.remove()
        outcome, self._outcome = self._outcome, None
        self.switched = outcome is not None and outcome.state == IN_USE
        return outcome

    def _prove(self, path: Path) -> None:
        try:
            told = self._install(path)
        except (BundleError, OSError) as error:
            self._outcome = Delivery(DECLINED, 0, str(error)[:400])
        else:
            self._outcome = Delivery(IN_USE, 0, told[:400])
