"""A serial cable for tests: two ptys, joined, that can be pulled and plugged in again."""

import os
import select
import sys
import threading

import pytest

if sys.platform == "win32":
    pytest.skip("Windows has no ptys", allow_module_level=True)

import pty
import tty


class Cable:
    """Two ptys, joined while `plugged`: a serial cable with a name at each end."""

    def __init__(self) -> None:
        self.plugged = True
        self._masters, self._slaves = [], []
        for _ in range(2):
            master, slave = pty.openpty()
            tty.setraw(slave)
            self._masters.append(master)
            self._slaves.append(slave)
        self.ends = [os.ttyname(slave) for slave in self._slaves]
        self._stop, self._stopped = os.pipe()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while True:
            readable, _, _ = select.select([*self._masters, self._stop], [], [])
            if self._stop in readable:
                return
            for here, there in (self._masters, self._masters[::-1]):
                if here in readable:
                    data = os.read(here, 4096)
                    if self.plugged:
                        os.write(there, data)

    def close(self) -> None:
        os.write(self._stopped, b"!")
        self._thread.join()
        for descriptor in (*self._masters, *self._slaves, self._stop, self._stopped):
            os.close(descriptor)
