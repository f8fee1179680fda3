"""A page in headless Chromium, driven by the DevTools protocol on loopback."""

import base64
import json
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.request import urlopen

from websockets.sync.client import ClientConnection, connect

from tests.support.waiting import PATIENCE_S, until

CHROMIUM = shutil.which("chromium")
Point = tuple[float, float]  # CSS pixels from the page's top left


class Page:
    """A page as a phone would show it, and fingers on it."""

    def __init__(self, socket: ClientConnection, size: tuple[int, int]) -> None:
        self._socket, self._number = socket, 0
        self.call("Page.enable")
        self.call("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=10)
        self.resize(size)

    def resize(self, size: tuple[int, int]) -> None:
        width, height = size
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=2, mobile=True,
        )  # fmt: skip

    def open(self, url: str) -> None:
        self.call("Page.navigate", url=url)

    def value(self, script: str) -> Any:
        """Return the value of an expression in the page."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True)
        return answer["result"].get("value")

    def touch(self, kind: str, points: Sequence[Point], radius: float = 22.0) -> None:
        """Put fingers down ("touchStart"), move them all ("touchMove"), or lift ("touchEnd")."""
        fingers = [
            {"x": x, "y": y, "id": number, "radiusX": radius, "radiusY": radius, "force": 0.5}
            for number, (x, y) in enumerate(points)
        ]
        self.call("Input.dispatchTouchEvent", type=kind, touchPoints=fingers)

    def picture(self, path: Path) -> None:
        """Save what the page shows as a PNG file."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))

    def call(self, method: str, **options: Any) -> Any:
        """Call a method of the protocol; return its result."""
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": options}))
        while True:
            answer = json.loads(self._socket.recv(PATIENCE_S))
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]


@contextmanager
def page(size: tuple[int, int] = (390, 844)) -> Iterator[Page]:
    """Start Chromium with an empty page of a phone's size, and end it."""
    assert CHROMIUM is not None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        options = ["--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run"]
        process = subprocess.Popen(
            [CHROMIUM, *options, "--remote-debugging-port=0", f"--user-data-dir={folder}"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            said = Path(folder, "DevToolsActivePort")
            port = until(lambda: (said.read_text() or "").split()[0], passing=(OSError, IndexError))
            with urlopen(f"http://127.0.0.1:{port}/json/list") as answer:
                found = [one for one in json.load(answer) if one["type"] == "page"]
            with connect(found[0]["webSocketDebuggerUrl"], max_size=None) as socket:
                yield Page(socket, size)
        finally:
            process.terminate()
            process.wait(PATIENCE_S)
