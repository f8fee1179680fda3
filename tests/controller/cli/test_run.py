"""The command line of the device: what it prints, and how it answers mistakes."""

import dataclasses
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from importlib.resources import files
from pathlib import Path

import pytest

from controller.__main__ import main
from controller.bundles import bundle
from controller.bundles.inference import onnxruntime_engine
from controller.bundles.inference.networks import Recognizer
from controller.capture.labels import Labeller
from controller.capture.session_recorder import SessionRecorder
from controller.cli.run import options_of
from controller.recognition.pipeline import Pipeline
from controller.recordings import reader
from controller.recordings.recorder import Recorder
from controller.recordings.recording import Provenance
from controller.runtime import assemble
from controller.runtime.assemble import TOKEN
from controller.runtime.device import Device, VirtualHand
from controller.sensors import base as sensors
from controller.sensors.virtual import show
from controller.shared.protocol import messages as wire
from controller.shared.shutdown import signals
from tests.support import manual_host
from tests.support.loop_bench import MessageLog
from tests.support.manual_host import HandMadeHost

BUNDLE = bundle.default_path(10.0)
JOIN = dataclasses.replace(manual_host.JOIN, granted=True)
PLAY_S = 40.0
PATIENCE_S = float(os.environ.get("ORBTOUCH_PATIENCE_S", "30"))  # an emulated processor needs more
_T0_ROW = 100  # of the recording made here: well after the rest image was taken


def session(path: Path, rate_hz: float = 10.0, seconds: float = PLAY_S) -> list[wire.Command]:
    """Record a session in which the virtual orb's hand shows every gesture; return its commands."""
    shipped = bundle.read(BUNDLE)
    sensor = sensors.load("virtual", rate_hz, seed=3)
    pipeline = Pipeline(shipped.settings, Recognizer(shipped), shipped.mapping)
    engine = onnxruntime_engine.version()
    origin = Provenance(
        sensor.device_id, 5, 5, 10.0, rate_hz, shipped.labels, shipped.hash, engine, "test"
    )
    labeller = Labeller(shipped.labels)
    tape = SessionRecorder(lambda state: Recorder(path, origin, state), pipeline, labeller)
    link = MessageLog()
    script = show(shipped.labels, sensor.geometry, seed=3)
    device = Device(sensor, pipeline, link, recorder=tape, hand=VirtualHand(script))
    for _ in range(round(seconds * rate_hz)):
        device.advance(rate_hz)
    device.close()
    return [message for message in link.sent if isinstance(message, wire.Command)]


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[wire.Command]]:
    """A recording, and the commands that the live run gave."""
    path = tmp_path_factory.mktemp("played") / "session.npz"
    return path, session(path)


# --- replay ---------------------------------------------------------------------------------------


def test_a_replay_prints_the_commands_of_the_live_run_twice_the_same(
    played: tuple[Path, list[wire.Command]], capsys: pytest.CaptureFixture[str]
) -> None:
    path, live = played
    assert main(["--replay", str(path)]) == 0
    first = capsys.readouterr().out
    assert main(["--replay", str(path)]) == 0
    assert capsys.readouterr().out == first
    lines = [json.loads(line) for line in first.splitlines()]
    assert len(lines) > 5
    assert list(lines[0]) == ["t", "gesture", "probability", "touch", "sigma", "command"]
    assert [(line["command"], line["gesture"], line["t"]) for line in lines] == [
        (command.name, command.label, command.frame / 10) for command in live
    ]


def test_a_recording_cut_from_the_middle_replays_from_its_state(
    played: tuple[Path, list[wire.Command]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = reader.load(played[0])
    shipped = bundle.read(BUNDLE)
    pipeline = Pipeline(shipped.settings, Recognizer(shipped), shipped.mapping)
    for frame, t_s in zip(source.frames[:_T0_ROW], source.t, strict=False):
        pipeline.step(frame, float(t_s))
    path = tmp_path / "rest.npz"
    recorder = Recorder(path, source.origin, pipeline.state())
    for k in range(_T0_ROW, len(source.frames)):
        recorder.journal.add_frame(source.frames[k], float(source.t[k]), int(source.sequence[k]))
    recorder.close()
    assert main(["--replay", str(path)]) == 0
    times = [json.loads(line)["t"] for line in capsys.readouterr().out.splitlines()]
    assert times == [c.frame / 10 for c in played[1] if c.frame > _T0_ROW]


def test_another_mapping_gives_other_commands(
    played: tuple[Path, list[wire.Command]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_text('press = "hold"')
    assert main(["--replay", str(played[0]), "--mapping", str(mine)]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert {line["command"] for line in lines if line["gesture"] == "press"} == {"hold"}


# --- mistakes -------------------------------------------------------------------------------------


def complaint(capsys: pytest.CaptureFixture[str], *argv: str | Path, status: int = 2) -> str:
    """Run with a mistake; return the one sentence that it was answered with."""
    assert main([str(word) for word in argv]) == status
    captured = capsys.readouterr()
    assert captured.out == ""
    (line,) = captured.err.splitlines()
    assert line.startswith("controller: ")
    return line


MISTAKES = [
    ("--sensor os.path", "there are emulated, lines, mpr121, orb, virtual"),
    ("--sensor replay", "use --replay FILE"),
    ("--replay @/x.npz", "does not exist"),
    ("--replay @/empty.npz", "is empty"),
    ("--replay @", "is not a file"),
    ("--rate 10.3", "more than 2 %"),
    ("--replay {DEMO} --record @/again.npz", "leave out --record"),
    ("--replay {DEMO} --fault dead:2,3", "a replay has no sensor; leave out --sensor, --preset"),
    ("--record @/empty.npz", "exists and is kept"),
    ("--label press", "--label is for recordings; add --record"),
    ("--seconds 4", "--seconds is for recordings; add --record"),
    ("--record @/nowhere", "there is no folder"),
    ("--record @ --user ../ada", "must be 1 to 64 letters"),
    ("--record @ --label poke", "there is no label 'poke'; there are press"),
    ("--record @ --label null", "there is no label 'null'"),
    ("--bundle @/x.orb", "does not exist"),
    ("--bundle @/damaged.orb", "is damaged"),
    ("--mapping @/mine.toml", "'poke' is unknown; known are press"),
    ("--link nowhere://x", "cannot open"),
    ("--link listen://0.0.0.0:0", "other machines"),
]


@pytest.mark.parametrize(("words", "told"), MISTAKES)
def test_a_mistake_is_answered_in_one_sentence_before_anything_runs(
    words: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = bytearray(BUNDLE.read_bytes())
    whole[len(whole) // 3] ^= 1
    (tmp_path / "damaged.orb").write_bytes(whole)
    (tmp_path / "empty.npz").touch()
    (tmp_path / "mine.toml").write_text('poke = "left"')
    words = words.replace("@", str(tmp_path)).replace("{DEMO}", "assets/demo.npz")
    assert told in complaint(capsys, *words.split())
    assert {path.name for path in tmp_path.iterdir()} == {"damaged.orb", "empty.npz", "mine.toml"}


def test_without_an_orb_the_message_says_what_to_do(capsys: pytest.CaptureFixture[str]) -> None:
    assert "try --sensor emulated" in complaint(capsys, "--sensor", "orb", status=1)


def test_a_recording_of_other_rate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "fast.npz"
    session(path, rate_hz=12.5, seconds=2.0)
    assert "12.50 Hz, the bundle at 40.00 Hz" in complaint(capsys, "--replay", path)


def test_the_bundle_that_ships_is_the_one_for_the_rate(caplog: pytest.LogCaptureFixture) -> None:
    def begun(*words: str) -> tuple[float, float]:
        parts = assemble.prepare(options_of([*words, "--link", "-"]))
        return parts.sensor.rate_hz, parts.bundle.rate_hz

    assert begun() == (40.0, 40.0)
    assert begun("--rate", "10") == (10.0, 10.0)
    assert begun("--replay", str(files("assets") / "demo.npz"))[1] == 10.0
    with caplog.at_level("INFO"):
        assert begun("--sensor", "emulated", "--fault", "slow_clock=3") == (10.0, 10.0)
    assert "it is read at 10 Hz, with the bundle for that" in caplog.text


def test_an_orb_that_is_too_slow_for_its_bundle_is_refused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    slow = ("--sensor", "emulated", "--fault", "slow_clock=3")
    for words in (("--rate", "40"), ("--bundle", bundle.default_path())):
        told = complaint(capsys, *slow, *words)
        assert "frames a second, the bundle needs 40; shorten [times]" in told


@pytest.mark.parametrize(
    ("words", "advice"),
    [
        (["--rate", "fast"], "fast must be a number from 0.1 to 1000"),
        (["--rate", "0"], "0 must be a number from 0.1 to 1000"),
        (["--no"], "unrecognized arguments: --no"),
        (["--recrod=x"], "unrecognized arguments: --recrod=x; did you mean --record?"),
    ],
)
def test_wrong_usage_is_answered_with_what_would_be_right(
    words: list[str], advice: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(words)
    assert advice in capsys.readouterr().err


@pytest.mark.parametrize("terminal", [True, False])
def test_a_hangup_ends_or_renews_a_run(terminal: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("stdin", "stdout", "stderr"):
        monkeypatch.setattr(f"sys.{name}.isatty", lambda: terminal)
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # under nohup a hangup means nothing
    try:
        with signals(renews=True) as ends:
            signal.raise_signal(signal.SIGHUP)
            assert (ends, ends.renew) == ((["SIGHUP"], False) if terminal else ([], True))
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_to_end_while_it_is_loading_ends_it_silently(number: signal.Signals) -> None:
    program = f"""
import signal, sys
from controller.bundles import bundle
from controller.__main__ import main
bundle.read = lambda path: signal.raise_signal({int(number)})
sys.exit(main(["--sensor", "virtual"]))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, "", "")


# --- as a process of its own ----------------------------------------------------------------------


class Process:
    """`controller` in a child process."""

    def __init__(self, *argv: str | Path, token: str = "") -> None:
        self.end: socket.socket | None = None
        environment = {**os.environ, TOKEN: token}
        command = [sys.executable, "-m", "controller", *map(str, argv)]
        pipe = subprocess.PIPE
        self.child = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, env=environment
        )

    def line(self) -> dict[str, object]:
        """Wait for the next line that it prints."""
        assert self.child.stdout is not None
        text = self.child.stdout.readline()
        assert text, self.child.communicate(timeout=PATIENCE_S)[1]
        line: dict[str, object] = json.loads(text)
        return line

    def connect(self) -> HandMadeHost:
        """Connect to it, after it has told where it listens."""
        place, port = str(self.line()["listening"]).removeprefix("socket://").split(":")
        self.end = end = socket.create_connection((place, int(port)), timeout=PATIENCE_S)
        return HandMadeHost(lambda: end.recv(4096), end.sendall)

    def stop(self, number: int | None = signal.SIGTERM) -> tuple[int, str, str]:
        """Ask it to end; return its exit status and what else it had to say."""
        if number is not None:
            self.child.send_signal(number)
        out, err = self.child.communicate(timeout=PATIENCE_S)
        return self.child.returncode, out, err

    def kill(self) -> None:
        if self.child.poll() is None:
            self.child.kill()
        self.child.communicate()
        if self.end is not None:
            self.end.close()


def hear(host: HandMadeHost, last: type[wire.Message]) -> list[wire.Message]:
    """Return what comes, until a message of this kind is among it."""
    heard: list[wire.Message] = []
    while not heard or not isinstance(heard[-1], last):
        message = host.message()
        assert message is not None
        heard.append(message)
    return heard


Start = Callable[..., Process]


@pytest.fixture
def start() -> Iterator[Start]:
    """Start processes that do not outlive the test."""
    with ExitStack() as stack:

        def start(*argv: str | Path, token: str = "") -> Process:
            process = Process(*argv, token=token)
            stack.callback(process.kill)
            return process

        yield start


def test_a_granted_session_is_recorded_and_replays_to_the_same_commands(
    start: Start, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "granted.npz"
    process = start("--link", "listen://127.0.0.1:0", "--seed", "4", "--record", path, token="t")
    host = process.connect()
    assert isinstance(host.greet(dataclasses.replace(JOIN, token="t")), wire.Welcome)
    heard: list[wire.Message] = []
    for number, place in enumerate(((0.5, 3.0), (3.5, 3.0), (2.0, 0.3)), 1):
        host.say(wire.Grant(3000 * number))
        host.say(wire.Perform(number, "press", *place))
        heard += hear(host, wire.Granted)
    host.say(wire.Grant(12_000))
    heard += hear(host, wire.Granted)
    assert process.stop()[0] == 0
    assert [m.number for m in heard if isinstance(m, wire.GroundTruth)] == [1, 2, 3]
    commands = [
        (m.name, m.frame / 40) for m in heard if isinstance(m, wire.Command | wire.NumberedCommand)
    ]
    assert [name for name, _ in commands] == ["left", "right", "down"]
    assert main(["--replay", str(path)]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [(line["command"], line["t"]) for line in lines] == commands


def test_an_orb_with_a_token_refuses_strangers(start: Start) -> None:
    process = start("--link", "listen://127.0.0.1:0", token="secret")
    assert isinstance(process.connect().greet(JOIN), wire.Refuse)
    assert process.stop(signal.SIGINT)[0] == 0


def test_an_orb_of_a_host_s_own_ends_when_the_host_does(start: Start) -> None:
    process = start("--link", "listen://127.0.0.1:0", token="secret")
    assert "listening" in process.line()
    assert process.child.stdin is not None
    process.child.stdin.close()  # as the system does for a host that is killed
    process.child.stdin = None
    status, _, messages = process.stop(None)
    assert status == 0
    assert "no host for" not in messages  # it waited for no other host


@pytest.mark.parametrize("arguments", [["--link", "listen://127.0.0.1:0"], []])
def test_a_reader_that_went_away_is_no_reason_for_a_traceback(arguments: list[str]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "controller", "--sensor", "virtual", *arguments]
    done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, text=True, timeout=60)
    os.close(writing)
    assert done.returncode == bool(arguments)  # commands may end; where it listens must be known
    assert "Traceback" not in done.stderr
    assert "Exception" not in done.stderr


def test_a_virtual_orb_plays_and_ctrl_c_seals_the_recording(start: Start, tmp_path: Path) -> None:
    path = tmp_path / "live.npz"
    process = start("--sensor", "virtual", "--link", "-", "--record", path)
    first = process.line()
    assert first["gesture"] in ("press", "pinch", "twist_cw", "twist_ccw")
    status, _, messages = process.stop(signal.SIGINT)
    assert status == 0
    assert "the simulated hand shows every gesture" in messages
    assert "Traceback" not in messages
    assert reader.load(path).commands[0].command == first["command"]


def test_a_killed_session_is_recovered_when_the_next_begins(start: Start, tmp_path: Path) -> None:
    killed = start("--sensor", "virtual", "--record", tmp_path / "one.npz")
    killed.line()  # a gesture, so there are some seconds
    killed.kill()
    assert [path.name for path in tmp_path.iterdir()] == ["one.journal"]
    process = start("--link", "listen://127.0.0.1:0", "--record", tmp_path)
    process.line()  # where it listens
    _, _, messages = process.stop()
    assert f"into {tmp_path / 'one.npz'}" in messages
    assert len(reader.load(tmp_path / "one.npz").frames) > 10
    assert [path.name for path in tmp_path.iterdir()] == ["one.npz"]  # nobody touched this one
