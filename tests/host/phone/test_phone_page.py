"""The page in a browser: real touch events become commands of the real virtual orb.

`python -m tests.host.phone.test_phone_page` prints how many of ten are understood, and how fast.
"""

import base64
import json
import math
import os
import shutil
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest
from websockets.sync.client import ClientConnection, connect

from controller.shared.protocol.messages import Command, Contacts
from host.app.application import OrbApp
from host.connection.receiver import Delivered, Received, Receiver
from host.connection.virtual_orb import VirtualOrbProcess
from host.phone import open_phone, page
from host.phone.server import PhoneServer
from host.ui.orb_state import OrbState
from host.ui.pointer_input import DomeArea
from tests.support.phone_tab import join, opened
from tests.support.waiting import PATIENCE_S, until
from tetris.kit import language
from tetris.window.menu_screen import MenuScreen

CHROMIUM = shutil.which("chromium")
Point = tuple[float, float]  # CSS pixels from the page's top left

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium"),
]

SIZE = (390, 844)
STATE = "document.getElementById('status').textContent"
LAST = "document.getElementById('last').textContent"
STEP_S = 1 / 60
APART_S = 0.8  # between two gestures


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
def browser_page(size: tuple[int, int] = (390, 844)) -> Iterator[Page]:
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


@dataclass
class Play:
    """The window's part: it passes fingers on, and takes commands."""

    app: OrbApp
    receiver: Receiver
    page: Page
    began_s: float = 0.0  # of the last stroke
    commands: list[tuple[str, float]] = field(default_factory=list)
    touched_s: list[float] = field(default_factory=list)  # when contacts were sent to the orb

    @property
    def phone(self) -> PhoneServer:
        assert self.app.phone is not None
        return self.app.phone

    def turn(self) -> None:
        """Do what the window's loop does."""
        self.receiver.wait(STEP_S)
        now_s, received = time.monotonic(), self.receiver.poll()
        self.take(received, now_s)
        self.app.tick(now_s, received)
        for message in self.app.outgoing(now_s):
            self.receiver.send(message)
            if isinstance(message, Contacts) and message.contacts:
                self.touched_s.append(time.monotonic())

    def take(self, received: Sequence[Received], now_s: float) -> None:
        found = (one.message for one in received if isinstance(one, Delivered))
        self.commands += [(one.name, now_s) for one in found if isinstance(one, Command)]

    def play(self, seconds: float) -> None:
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            self.turn()

    def until(self, holds: Callable[[], object]) -> None:
        end_s = time.monotonic() + PATIENCE_S
        while not holds():
            assert time.monotonic() < end_s
            self.turn()

    def choose(self, name: str) -> None:
        """Take an item of the page in the window."""
        screen = self.app.stage.screen
        assert isinstance(screen, MenuScreen)
        next(one.do for one in screen.menu.items if one.label == name and one.do)()
        self.play(0.1)

    def stroke(self, path: Sequence[Sequence[Point]], hold_s: float) -> list[tuple[str, float]]:
        """Put fingers down, move them along, hold and lift them; return what came, and when."""
        self.commands.clear()
        self.touched_s.clear()
        began_s = self.began_s = time.monotonic()
        self.page.touch("touchStart", path[0])
        for points in path[1:]:
            self.play(STEP_S)
            self.page.touch("touchMove", points)
        self.play(hold_s)
        self.page.touch("touchEnd", [])
        self.play(APART_S)
        return [(name, at_s - began_s) for name, at_s in self.commands]


@contextmanager
def playing() -> Iterator[Play]:
    """Start the virtual orb, the application without a window, the phone's server and a browser."""
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    app, own = OrbApp(sound=False), VirtualOrbProcess(3)
    app.phone = open_phone("127.0.0.1:0")
    receiver = Receiver(own.open, token=own.token)
    receiver.start()
    try:
        with browser_page(SIZE) as browser:
            play = Play(app, receiver, browser)
            browser.open(app.phone.url)
            play.until(lambda: app.state.ready and app.virtual and play.phone.phone)
            play.play(APART_S)
            yield play
    finally:
        app.phone.close()
        app.close()
        receiver.close()
        own.close()


@pytest.fixture(scope="module")
def play() -> Iterator[Play]:
    with playing() as made:
        yield made


HEAD = 208  # height of the board and the words above the dome
CENTRE, RADIUS = (SIZE[0] / 2, (HEAD + SIZE[1]) / 2), SIZE[0] / 2 - 12


def at(x: float, y: float) -> Point:
    """Return a point of the dome, in its radii from the centre, y up, as one of the page."""
    return CENTRE[0] + x * RADIUS, CENTRE[1] - y * RADIUS


def press(x: float, y: float) -> list[list[Point]]:
    return [[at(x, y)]]


def pinch(open_: float = 0.45, closed: float = 0.2, steps: int = 9) -> list[list[Point]]:
    """Return two fingers that close, on a slant as a thumb and an index finger are."""
    angle = math.radians(35)
    path = []
    for step in range(steps):
        away = open_ + (closed - open_) * step / (steps - 1)
        x, y = away * math.cos(angle), away * math.sin(angle)
        path.append([at(x, y), at(-x, -y)])
    return path


def twist(turn_deg: float, begin_deg: float = 60.0, steps: int = 20) -> list[list[Point]]:
    """Return two fingers that go round the middle; counterclockwise is positive."""
    path = []
    for step in range(steps):
        angle = math.radians(begin_deg + turn_deg * step / (steps - 1))
        x, y = 0.48 * math.cos(angle), 0.48 * math.sin(angle)
        path.append([at(x, y), at(-x, -y)])
    return path


GESTURES = {
    "left": (press(-0.5, 0.25), 0.35),
    "right": (press(0.5, 0.25), 0.35),
    "down": (press(0.0, -0.55), 0.35),
    "drop": (pinch(), 0.25),
    "rotate_cw": (twist(-90.0), 0.1),
    "rotate_ccw": (twist(90.0, begin_deg=120.0), 0.1),
}


@pytest.mark.parametrize("name", GESTURES)
def test_fingers_on_the_page_give_a_command(play: Play, name: str) -> None:
    # In real time, so on a busy machine the orb may miss frames, and the gesture with them.
    strokes = ([command for command, _ in play.stroke(*GESTURES[name])] for _ in range(3))
    assert [name] in strokes


def test_a_command_is_read_and_felt_on_the_phone(play: Play) -> None:
    play.page.value("navigator.vibrate = () => { window.felt = true; }; 0")
    for _ in range(3):  # as above
        if play.stroke(*GESTURES["left"]):
            break
    assert play.page.value("window.felt")
    assert play.page.value(LAST) == "press → left"


def test_a_page_that_is_loaded_again_is_the_same_phone(play: Play) -> None:
    before = play.phone.phone
    play.page.open(play.phone.url)
    until(lambda: play.phone.phone not in (None, before))
    assert not play.phone.refused


def test_a_finger_that_leaves_the_dome_slides_along_its_edge(play: Play) -> None:
    play.page.touch("touchStart", [at(0.8, 0.0)])
    play.page.touch("touchMove", [at(1.5, 0.0)])
    (finger,) = until(lambda: [one for one in play.phone.contacts if one.x > 2 + 0.9 * 3.8])
    assert (finger.x, finger.y) == pytest.approx((2 + 0.96 * 3.8, 2), abs=0.15)
    play.page.touch("touchEnd", [])
    until(lambda: not play.phone.contacts)


def test_a_second_phone_and_one_whose_page_ends_read_a_sentence() -> None:
    phone = open_phone("127.0.0.1:0")
    phone.view = page.view(OrbState(), language.load("en"), DomeArea(), 0.0)
    with browser_page(SIZE) as browser:
        with opened(phone.url) as first:
            join(first)
            browser.open(phone.url)
            until(lambda: "Another phone is connected" in str(browser.value(STATE)))
        phone.close()
        phone = open_phone("127.0.0.1:0")
        phone.view = page.view(OrbState(), language.load("en"), DomeArea(), 0.0)
        browser.open(phone.url)
        until(lambda: browser.value(STATE) == "connecting")  # the orb is
        phone.close()
        until(lambda: "This connection has ended" in browser.value(STATE))


def main() -> None:
    with playing() as play:
        for name, gesture in GESTURES.items():
            found, onto_orb_ms = [], []
            for _ in range(10):
                found.append(play.stroke(*gesture))
                onto_orb_ms.append(1000 * (play.touched_s[0] - play.began_s))
            right = [one for one in found if [command for command, _ in one] == [name]]
            times_ms = sorted(1000 * one[0][1] for one in right)
            usual = f"{statistics.median(times_ms):.0f} ms" if times_ms else "-"
            wrong = [[command for command, _ in one] for one in found if one not in right]
            print(
                f"{name}: {len(right)} of 10, half within {usual}, else {wrong}; "
                f"half of the touches within {statistics.median(onto_orb_ms):.0f} ms on the orb"
            )


if __name__ == "__main__":
    main()
