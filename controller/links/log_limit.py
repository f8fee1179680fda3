"""Rate limit for log lines that a peer can cause, so that none can fill the disk with them."""

import time
from collections import deque
from collections.abc import Callable
from typing import Final

HUSH_S: Final = 10.0
LINES: Final = 20  # within that time


class LogLimit:
    """Decides which lines are logged: each of them once within `HUSH_S`, and `LINES` in all."""

    def __init__(self, lines: int = LINES, clock: Callable[[], float] = time.monotonic) -> None:
        """Prepare for so many lines within `HUSH_S`; `clock` returns seconds."""
        self._clock = clock
        self._logged: deque[tuple[float, str]] = deque(maxlen=lines)

    def lets(self, line: str) -> bool:
        """Return whether to log a line now."""
        now_s = self._clock()
        while self._logged and now_s - self._logged[0][0] >= HUSH_S:
            self._logged.popleft()
        if len(self._logged) == self._logged.maxlen or any(line == old for _, old in self._logged):
            return False
        self._logged.append((now_s, line))
        return True
