"""Taps: what other programs read along, read by their own libraries; loopback only."""

from __future__ import annotations

import dataclasses
import queue
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import pytest

from controller.shared.protocol.codec import quantise_image
from controller.shared.protocol.messages import Command, ContactState, Message, Telemetry, Welcome
from host import taps
from host.connection.receiver import Connected, Delivered, Lost, Missed, Received, Stale
from host.taps import Tap, TapError, TapThread, TapUnavailableError, open_taps
from tests.support.fake_device import welcome
from tests.support.pytest_types import Patch

PATIENCE_S = 20.0
IMAGE = [1.0 - 0.005 * (taxel % 5) for taxel in range(25)]
SHARES = (0.0, 0.2, 0.8, 0.0, 0.0)
WELCOME = dataclasses.replace(welcome(virtual=False), device_id="orb-7", name="Blue")


def frame(number: int, gesture: str = "") -> Received:
    message = Telemetry(number, quantise_image(IMAGE), SHARES, (1.0, 2.0), gesture, True, 10.0)
    return delivered(message, 100 * number)


def delivered(message: Message, t_ms: int) -> Received:
    return Delivered(message, t_ms)


SESSION: list[Received] = [
    Connected(WELCOME),
    frame(1),
    frame(2, "press"),
    delivered(Command("left", "press", 0.75, (1.0, 2.0), 2), 200),
    frame(3, "press"),
    frame(4),
    delivered(Command("drop", "pinch", 0.5, None, 4), 400),
    Stale(),
    Missed(2),
    frame(5),
    Lost("it was cut off"),
]


def test_every_tap_of_the_folder_refuses_an_address_that_is_none() -> None:
    assert taps.names() == ("lsl", "osc")
    for name in taps.names():
        with pytest.raises(TapError, match=f"--tap {name}://"):
            taps.open_tap(f"{name}://where/is/that")
    with pytest.raises(TapError, match="there is no tap 'midi'; there are: lsl, osc"):
        taps.open_tap("midi")


@pytest.mark.parametrize(
    ("name", "module", "advice"),
    [
        ("lsl", "pylsl", r"'orbtouch\[lsl\]' \(in a clone: pip install -e '.\[lsl\]'\)"),
        ("osc", "pythonosc", r"orbtouch\[osc\]"),
    ],
)
def test_missing_library_is_told(name: str, module: str, advice: str, monkeypatch: Patch) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(TapUnavailableError, match=advice):
        taps.open_tap(name)


class Broken:
    """Stands before pylsl's import: the package is there, the library that it binds is not."""

    def find_spec(self, name: str, path: object, target: object = None) -> None:
        if name == "pylsl":
            raise RuntimeError("LSL binary library file was not found.\nPlease make sure ...")


def test_missing_library_file_is_one_sentence(monkeypatch: Patch) -> None:
    monkeypatch.delitem(sys.modules, "pylsl", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Broken(), *sys.meta_path])
    with pytest.raises(TapUnavailableError, match=r"needs the library liblsl.*was not found\.\)"):
        taps.open_tap("lsl")


# -- the thread between the program and a tap ------------------------------------------------


class Slow(Tap):
    """A tap that takes nothing until it may."""

    def __init__(self) -> None:
        self.may = threading.Event()
        self.took: list[str] = []
        self.closed = False

    def connected(self, welcome: Welcome) -> None:
        self.took.append(welcome.device_id)

    def telemetry(self, message: Telemetry, t_ms: int) -> None:
        assert self.may.wait(PATIENCE_S)
        self.took.append(f"frame {message.frame}")

    def gesture(self, label: str, t_ms: int) -> None:
        self.took.append(f"gesture {label}")

    def command(self, message: Command, t_ms: int) -> None:
        self.took.append(f"command {message.name}")

    def contact(self, message: ContactState, t_ms: int) -> None:
        self.took.append(f"{message.fingers} fingers at {t_ms}")

    def missed(self, count: int) -> None:
        self.took.append(f"missed {count}")

    def link(self, state: str) -> None:
        self.took.append(state)

    def close(self) -> None:
        self.closed = True


def test_tap_hears_every_change_once_and_in_order() -> None:
    tap = Slow()
    tap.may.set()
    worker = TapThread("slow", tap)
    worker.hear(SESSION)
    worker.close()
    assert tap.took == [
        *("orb-7", "live", "frame 1", "frame 2", "gesture press", "command left"),
        *(
            "frame 3",
            "frame 4",
            "gesture ",
            "command drop",
            "stale",
            "missed 2",
            "live",
            "frame 5",
            "lost",
        ),
    ]
    assert (worker.dropped, worker.failure, tap.closed) == (0, "", True)


FINGER = ContactState(6, 2.0, 1.5, 0.25, 6.0, 0.5, 1, 0.875, 0.0, 0.0, 1.5, 0.25)


@pytest.mark.parametrize("silence", [Stale(), Lost("it was cut off"), Connected(WELCOME)], ids=str)
def test_tap_hears_the_end_of_a_contact_that_the_link_did_not_bring(silence: Received) -> None:
    tap = Slow()
    worker = TapThread("slow", tap)
    worker.hear([Connected(WELCOME), delivered(FINGER, 600), silence, Stale()])
    worker.close()
    assert tap.took[2:4] == ["1 fingers at 600", "0 fingers at 600"]
    assert "fingers" not in "".join(tap.took[4:])


def test_slow_tap_drops_and_counts_and_holds_up_nobody() -> None:
    tap = Slow()
    worker = TapThread("slow", tap, waiting=8)
    for number in range(1000):
        worker.hear([frame(number)])  # never waits: the tap takes nothing yet
    assert 990 <= worker.dropped <= 992
    tap.may.set()
    worker.close()
    assert len([word for word in tap.took if word.startswith("frame")]) == 1000 - worker.dropped


def test_failing_tap_is_told_with_traceback_then_counted(caplog: pytest.LogCaptureFixture) -> None:
    tap = Slow()
    tap.may.set()
    tap.command = None  # type: ignore[method-assign, assignment]
    said: list[str] = []
    worker = TapThread("slow", tap)
    with ExitStack() as stack:
        stack.callback(taps._end, worker, said.append)
        worker.hear(SESSION)
    assert tap.closed
    [record] = caplog.records
    assert record.levelname == "ERROR"
    assert "TypeError" in caplog.text
    assert "stopped: 'NoneType' object is not callable" in said[0]
    assert "too slow, and did not get 7 messages" in said[1]


# -- Open Sound Control ----------------------------------------------------------------------


@pytest.fixture
def osc() -> Iterator[tuple[str, queue.SimpleQueue[tuple[Any, ...]]]]:
    """A server of python-osc: where it listens, and what it has heard."""
    pytest.importorskip("pythonosc", reason="needs the [osc] extra")
    from pythonosc.dispatcher import Dispatcher
    from pythonosc.osc_server import BlockingOSCUDPServer

    heard: queue.SimpleQueue[tuple[Any, ...]] = queue.SimpleQueue()
    dispatcher = Dispatcher()
    dispatcher.set_default_handler(lambda *message: heard.put(message))
    with BlockingOSCUDPServer(("127.0.0.1", 0), dispatcher) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield f"osc://127.0.0.1:{server.server_address[1]}", heard
        server.shutdown()
        thread.join()


def test_osc_server_hears_everything(osc: tuple[str, queue.SimpleQueue[tuple[Any, ...]]]) -> None:
    url, heard = osc
    with ExitStack() as stack:
        [worker] = open_taps([url], stack, pytest.fail)
        worker.hear(SESSION)
        messages = [heard.get(timeout=PATIENCE_S) for _ in range(21)]
    about, labels, commands, live, first, shares = messages[:6]
    assert about == ("/orbtouch/device", "orb-7", "Blue", 5, 5, 10.0, 10.0, 0)
    assert labels == ("/orbtouch/labels", *WELCOME.labels)
    assert commands == ("/orbtouch/commands", *WELCOME.commands)
    assert live == ("/orbtouch/link", "live")
    assert first[:2] == ("/orbtouch/frame", 1)
    assert first[2:] == pytest.approx([0.1, *IMAGE])
    assert shares[:2] == ("/orbtouch/probabilities", 1)
    assert shares[2:] == pytest.approx([0.1, *SHARES])
    told = [m[:2] for m in messages[6:] if m[0].split("/")[2] not in ("frame", "probabilities")]
    assert told == [
        *(("/orbtouch/gesture", "press"), ("/orbtouch/command", "left")),
        *(("/orbtouch/gesture", ""), ("/orbtouch/command", "drop")),
        *(("/orbtouch/link", "stale"), ("/orbtouch/missed", 2), ("/orbtouch/link", "live")),
    ]
    left, drop = (m for m in messages if m[0] == "/orbtouch/command")
    assert left[2:] == ("press", pytest.approx(0.2), 0.75, 1.0, 2.0)
    assert drop[2:] == ("pinch", pytest.approx(0.4), 0.5)


def test_osc_server_hears_contacts(osc: tuple[str, queue.SimpleQueue[tuple[Any, ...]]]) -> None:
    url, heard = osc
    with ExitStack() as stack:
        [worker] = open_taps([url], stack, pytest.fail)
        worker.hear([Connected(WELCOME), delivered(FINGER, 600), delivered(ContactState(6), 700)])
        *_, touch, end = [heard.get(timeout=PATIENCE_S) for _ in range(6)]
    assert touch[:3] == ("/orbtouch/contact", 6, pytest.approx(0.6))
    assert touch[3:] == (2.0, 1.5, 0.25, 6.0, 0.5, 1, 0.875, 0.0, 0.0, 1.5, 0.25)
    assert end == ("/orbtouch/contact", 6, pytest.approx(0.7), *[0] * 11)


def test_device_is_described_again_for_who_listens_later() -> None:
    from host.taps.osc import DESCRIBE_S, OscTap

    class Client:
        def __init__(self) -> None:
            self.sent: list[str] = []

        def send_message(self, address: str, values: object) -> None:
            self.sent.append(address)
            if address.endswith("labels"):
                raise ConnectionRefusedError("nobody listened to the last one")

        def close(self) -> None:
            pass

    now_s = 100.0
    client: Any = Client()
    tap = OscTap(client, lambda: now_s)
    tap.connected(WELCOME)
    news = frame(1)
    assert isinstance(news, Delivered)
    assert isinstance(news.message, Telemetry)
    for _ in range(4):
        now_s += DESCRIBE_S / 2
        tap.telemetry(news.message, news.t_ms)
    assert client.sent.count("/orbtouch/device") == 3
    assert client.sent.count("/orbtouch/frame") == 4


# -- Lab Streaming Layer ---------------------------------------------------------------------


@pytest.fixture
def lsl() -> Any:
    """The library pylsl, or a reason to skip."""
    try:
        import pylsl
    except (ImportError, OSError, RuntimeError) as error:
        pytest.skip(f"needs the [lsl] extra, and liblsl: {error}")
    return pylsl


def inlets(lsl: Any, device_id: str) -> dict[str, Any]:
    """Open pylsl's own inlet to each of the five streams."""
    found = {}
    for name in ("frames", "probabilities", "contacts", "gestures", "commands"):
        source = f"{device_id}:{name}"
        [info] = lsl.resolve_byprop("source_id", source, minimum=1, timeout=PATIENCE_S)
        found[name] = lsl.StreamInlet(info)
        found[name].open_stream(timeout=PATIENCE_S)
    return found


def test_inlets_of_pylsl_read_five_described_streams(lsl: Any) -> None:
    # An identity of its own, so that no other test on this machine is heard.
    known = dataclasses.replace(WELCOME, device_id=f"orb-{threading.get_native_id()}")
    with ExitStack() as stack:
        [worker] = open_taps(["lsl"], stack, pytest.fail)
        worker.hear([Connected(known)])
        streams = inlets(lsl, known.device_id)
        before_s = lsl.local_clock()
        worker.hear([delivered(FINGER, 50), *SESSION[1:]])
        sample, first_s = streams["frames"].pull_sample(timeout=PATIENCE_S)
        _, second_s = streams["frames"].pull_sample(timeout=PATIENCE_S)
        contacts = [streams["contacts"].pull_sample(timeout=PATIENCE_S)[0] for _ in range(2)]
        shares, _ = streams["probabilities"].pull_sample(timeout=PATIENCE_S)
        markers = [streams["gestures"].pull_sample(timeout=PATIENCE_S)[0] for _ in range(2)]
        commands = [streams["commands"].pull_sample(timeout=PATIENCE_S)[0] for _ in range(2)]
        about = {name: stream.info(timeout=PATIENCE_S) for name, stream in streams.items()}
        for stream in streams.values():
            stream.close_stream()
    assert sample == pytest.approx(IMAGE, abs=1e-6)
    assert contacts == [[2.0, 1.5, 0.25, 6.0, 0.5, 1.0, 0.875, 0.0, 0.0, 1.5, 0.25], [0.0] * 11]
    assert shares == pytest.approx(SHARES, abs=1e-6)
    assert markers == [["press"], ["none"]]
    assert commands == [["left", "press"], ["drop", "pinch"]]
    assert before_s - 1.0 <= first_s <= lsl.local_clock()
    assert second_s - first_s <= 0.1 + 1e-6  # the device's time, and never later than it came
    frames, gestures = about["frames"], about["gestures"]
    assert (frames.type(), frames.nominal_srate(), frames.channel_count()) == (
        *("Capacitance", WELCOME.rate_hz, 25),
    )
    assert frames.get_channel_labels()[:6] == [
        *(f"row0_column{column}" for column in range(5)),
        "row1_column0",
    ]
    assert frames.get_channel_units() == ["C/C0"] * 25
    assert about["probabilities"].get_channel_labels() == list(WELCOME.labels)
    assert about["contacts"].get_channel_units()[3:6] == ["mm", "mm", "count"]
    assert about["contacts"].nominal_srate() == lsl.IRREGULAR_RATE
    assert (gestures.type(), gestures.nominal_srate()) == ("Markers", lsl.IRREGULAR_RATE)
    device = frames.desc().child("device")
    assert device.child_value("id") == known.device_id
    assert device.child_value("pitch_mm") == "10"


class FakeLsl:
    """pylsl as far as a tap needs it, on a clock of the test's own."""

    IRREGULAR_RATE, cf_float32, cf_string = 0.0, 1, 3

    def __init__(self) -> None:
        self.now_s = 1000.0
        self.made: list[str] = []
        self.pushed: list[tuple[str, float]] = []

    def local_clock(self) -> float:
        return self.now_s

    def StreamInfo(self, name: str, kind: str, count: int, *rest: Any) -> FakeInfo:  # noqa: N802
        return FakeInfo(name, count)

    def StreamOutlet(self, info: FakeInfo, max_buffered: int) -> FakeOutlet:  # noqa: N802
        self.made.append(info.name)
        return FakeOutlet(self, info)


class FakeInfo:
    def __init__(self, name: str, count: int) -> None:
        self.name, self.count = name, count

    def desc(self) -> FakeInfo:
        return self

    def append_child(self, name: str) -> FakeInfo:
        return self

    def append_child_value(self, name: str, value: str) -> None:
        pass

    set_channel_labels = set_channel_types = set_channel_units = lambda self, value: None


class FakeOutlet:
    def __init__(self, lsl: FakeLsl, info: FakeInfo) -> None:
        self._lsl, self._info, self.channel_count = lsl, info, info.count

    def push_sample(self, sample: list[Any], stamp_s: float) -> None:
        self._lsl.pushed.append((self._info.name, stamp_s))


def test_outlets_outlive_a_reconnection_of_the_same_device_but_not_another_shape() -> None:
    from host.taps.lsl import LslTap

    lsl = FakeLsl()
    tap = LslTap(lsl)
    tap.connected(WELCOME)
    tap.connected(dataclasses.replace(WELCOME, boot_nonce=99))
    assert len(lsl.made) == 5
    tap.connected(dataclasses.replace(WELCOME, rows=4))
    assert len(lsl.made) == 10


def test_samples_have_the_device_s_time_whenever_they_arrive() -> None:
    from host.taps.lsl import LslTap

    lsl = FakeLsl()
    tap = LslTap(lsl)
    tap.connected(WELCOME)
    for delay_s, number in ((0.030, 1), (0.010, 2), (0.200, 3), (0.010, 4)):
        lsl.now_s = 1000.0 + number / 10 + delay_s
        tap.gesture("press", 100 * number)
    stamps = [stamp_s for _, stamp_s in lsl.pushed]
    assert stamps == pytest.approx([1000.13, 1000.21, 1000.31, 1000.41])


def test_device_that_lies_about_its_shape_pushes_nothing() -> None:
    from host.taps.lsl import LslTap

    lsl = FakeLsl()
    tap = LslTap(lsl)
    tap.connected(WELCOME)
    tap.telemetry(Telemetry(1, b"\x80" * 9, (1.0,), None, "", True, 10.0), 100)
    assert lsl.pushed == []
