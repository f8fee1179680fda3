"""Identified users change what their gestures mean and whose network judges them; nothing more."""

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.__main__ import main
from controller.bundles import bundle
from controller.bundles.inference.networks import Recognizer
from controller.capture.labels import Labeller
from controller.capture.session_recorder import SessionRecorder
from controller.cli.run import options_of
from controller.recognition.images.frames import Frame, Image, Window
from controller.recognition.mapping import Mapping, Rule
from controller.recognition.pipeline import Networks, Pipeline, Step
from controller.recordings.recorder import Recorder
from controller.recordings.recording import Provenance
from controller.runtime import assemble
from controller.runtime.device import Device, VirtualHand
from controller.sensors import base as sensors
from controller.sensors.base import Sensor
from controller.sensors.virtual import Virtual, show
from controller.shared.protocol.messages import Command, UserIdentified
from tests.support import user_bundles as enrolled
from tests.support.loop_bench import MessageLog

REST: Frame = np.full((5, 5), 40.0, dtype=np.float32)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return enrolled.write(tmp_path_factory.mktemp("people") / "two.orb")


def felt(*words: str) -> list[Frame]:
    """What the virtual orb feels of a twist in the first seconds."""
    virtual = assemble.prepare(options_of(words)).sensor
    assert isinstance(virtual, Virtual)
    virtual.perform(1, "twist_cw", 2.0, 2.0, 0.5)
    return [virtual.read(k / 40) for k in range(1, 97)]


def test_the_virtual_orb_has_the_hand_of_user_and_day() -> None:
    taught = sensors.load("virtual", 40.0, user="ada", day="6")
    assert isinstance(taught, Virtual)
    taught.perform(1, "twist_cw", 2.0, 2.0, 0.5)
    frames = [taught.read(k / 40) for k in range(1, 97)]
    assert np.array_equal(felt("--sensor", "virtual:user=ada,day=6"), frames)
    for other in ("virtual", "virtual:user=ben,day=6", "virtual:user=ada,day=7"):
        assert not np.array_equal(felt("--sensor", other), frames)


class Certain(Networks):
    """Networks that see a pinch wherever something touches, and who it is by the side."""

    asked: list[str]
    deepest: dict[str, float]  # greatest |z - 1| that was seen of each user

    def __init__(self) -> None:
        self.asked, self.deepest = [], {}

    def probabilities(self, window: Window, user: str = "") -> NDArray[np.float32]:
        self.asked.append(user)
        seen = float(np.abs(window - 1.0).max())
        self.deepest[user] = max(seen, self.deepest.get(user, 0.0))
        touched = float(np.abs(window[-1] - 1.0).max()) > 0.1
        return np.array([1 - touched, 0, touched, 0, 0], dtype=np.float32)

    def people(self, window: Window) -> NDArray[np.float32]:
        left = np.abs(window[-1, :, :2] - 1.0).max() > 0.1
        return np.array([0.1, 0.8, 0.1] if left else [0.1, 0.1, 0.8], dtype=np.float32)

    def touch(self, image: Image) -> tuple[float, float]:
        return 2.0, 2.0


def touched(x: int) -> Frame:
    frame = REST.copy()
    frame[2, x] *= 0.4
    return frame


LEFT = [touched(0)] * 10 + [REST] * 15
RIGHT = [touched(4)] * 10 + [REST] * 15


def played(pipeline: Pipeline, frames: list[Frame], start: int = 1) -> list[Step]:
    return [pipeline.step(f, k / 10, k) for k, f in enumerate(frames, start)]


def test_a_person_is_known_after_some_gestures_and_theirs_mean_what_they_want(path: Path) -> None:
    two = bundle.read(path)
    networks = Certain()
    steps = played(
        Pipeline(two.settings, networks, two.mapping), [REST] * 20 + RIGHT * 3 + LEFT * 6
    )
    commands = [step.command.command for step in steps if step.command]
    assert commands[0] == "drop"  # nobody knows yet who it is
    assert commands[2] == "hold"  # bob's own
    assert commands[-1] == "drop"  # ann has no rules of her own
    assert {"", "ann", "bob"} == set(networks.asked)
    assert [steps[94].user, steps[-1].user] == ["bob", "ann"]
    assert steps[-1].confidence > 0.9
    for before, now in pairwise(steps):  # nothing changes amid a gesture
        assert now.user == before.user or not now.held


def test_who_said_who_plays_is_believed_and_nobody_is_asked(path: Path) -> None:
    two = bundle.read(path)
    pipeline = Pipeline(two.settings, Certain(), two.mapping, player="bob")
    steps = played(pipeline, [REST] * 20 + LEFT * 4)
    assert {(step.user, step.confidence) for step in steps} == {("bob", 1.0)}
    assert [step.command.command for step in steps if step.command] == ["hold"] * 4
    assert not any(key.startswith("users.") for key in pipeline.state())


def test_the_touch_strength_of_whoever_is_identified_is_used_until_another_one_is(
    path: Path,
) -> None:
    two = bundle.read(path)
    users = replace(two.users, strengths={"ann": 0.5})
    networks = Certain()
    pipeline = Pipeline(replace(two.settings, users=users), networks, two.mapping)
    strengths = []
    for frame in [REST] * 20 + LEFT * 3 + RIGHT * 6:
        step = pipeline.step(frame, 0.0)
        strengths.append((step.user, pipeline.strength))
    assert set(strengths) == {("", 1.0), ("ann", 0.5), ("bob", 1.0)}
    felt = float(np.abs(step.image - 1.0).max())
    assert felt < 0.1  # what is shown at rest is not scaled
    assert networks.deepest["ann"] == pytest.approx(2.0 * networks.deepest["bob"], rel=0.05)


@pytest.mark.parametrize(("player", "strength"), [("ann", 0.5), ("bob", 2.0), ("", 2.0)])
def test_the_touch_strength_of_a_user_is_theirs_or_that_of_all(
    path: Path, player: str, strength: float
) -> None:
    two = bundle.read(path)
    users = replace(two.users, strengths={"ann": 0.5})
    settings = replace(two.settings, users=users, strength=2.0)
    pipeline = Pipeline(settings, Certain(), two.mapping, player=player)
    assert pipeline.strength == strength
    pipeline.exchange(two.settings, Certain(), two.mapping)
    assert pipeline.strength == 1.0


def test_the_noise_of_a_light_hand_is_amplified_for_the_debouncer_too(path: Path) -> None:
    two = bundle.read(path)
    settings = replace(two.settings, debounce=replace(two.debounce, noise=0.02))
    noise = np.random.default_rng(1).normal(1.0, 0.01, (60, 5, 5))
    frames = [(REST * one).astype(np.float32) for one in noise]
    frames += [(f * one).astype(np.float32) for f, one in zip(LEFT, noise, strict=False)]

    def answered(strength: float) -> int:
        own = replace(settings, strength=strength)
        steps = played(Pipeline(own, Certain(), two.mapping, player="bob"), frames)
        return next(step.frame for step in steps if step.gesture)

    assert answered(0.5) > answered(1.0)


def test_a_mapping_that_was_asked_for_goes_over_everybody_s_own(path: Path) -> None:
    two = bundle.read(path)
    asked = Mapping({"pinch": (Rule("menu"),)})
    users = two.users.overridden(asked, {})
    table = two.mapping.overridden(asked)
    assert users.mapping("bob", table).command("pinch", None) == "menu"
    assert "hold" in two.users.commands(two.mapping)


def test_a_mapping_file_has_rules_for_single_people(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "home.toml"
    file.write_text('pinch = "menu"\n[users.ann]\npinch = "pause"\n')
    options = options_of(["--bundle", str(path), "--mapping", str(file)])
    made = assemble.prepare(options)
    users, of_all = made.bundle.users, made.mapping
    asked = {who: users.mapping(who, of_all).command("pinch", None) for who in ("", "ann", "bob")}
    assert asked == {"": "menu", "ann": "pause", "bob": "menu"}
    for text, why in (
        ('[users.zoe]\npinch = "drop"', "for 'zoe'; enrolled are ann, bob"),
        ("[users.ann]\nwave = 'drop'", "the gesture 'wave' is unknown"),
        ('[users."\\u001b"]', r"rules for '\x1b'"),
        ("users = 3", "[users] holds anything but a table for each name"),
    ):
        file.write_text(text)
        assert main(["--bundle", str(path), "--mapping", str(file)]) == 2
        assert why in capsys.readouterr().err


def test_a_session_goes_on_exactly_after_a_cut(path: Path) -> None:
    two = bundle.read(path)
    frames = [REST] * 20 + RIGHT * 2 + LEFT
    whole = played(Pipeline(two.settings, Certain(), two.mapping), frames)
    for cut in (25, 33, 60, 78):
        first, second = (Pipeline(two.settings, Certain(), two.mapping) for _ in range(2))
        played(first, frames[:cut])
        second.restore(first.state())
        for one, other in zip(whole[cut:], played(second, frames[cut:], cut + 1), strict=True):
            assert (one.user, one.confidence, one.command) == (
                other.user, other.confidence, other.command,
            )  # fmt: skip


class Scripted(Sensor):
    """A sensor with frames of its own."""

    device_id, rate_hz = "scripted", 10.0

    def __init__(self, frames: list[Frame]) -> None:
        self.frames = iter(frames)

    def read(self, t_s: float) -> Frame:
        return next(self.frames)


def test_the_host_is_told_when_that_changes_and_once_when_it_comes(path: Path) -> None:
    two = bundle.read(path)
    frames = [REST] * 20 + RIGHT * 3
    link = MessageLog()
    pipeline = Pipeline(two.settings, Certain(), two.mapping)
    device = Device(Scripted(frames), pipeline, link)
    for _ in range(len(frames) - 1):
        device.advance(10.0)
    who = [message for message in link.sent if isinstance(message, UserIdentified)]
    assert [one.user for one in who] == ["", "", "bob", "bob"]
    assert [one.confidence for one in who] == sorted(one.confidence for one in who)
    device.greet(100.0)
    device.advance(10.0)
    assert link.sent.count(who[-1]) == 2


def test_a_bundle_that_knows_nobody_says_nothing_of_who() -> None:
    shipped = bundle.read(enrolled.SHIPPED)
    link = MessageLog()
    pipeline = Pipeline(shipped.settings, Certain(), shipped.mapping)
    frames = [REST] * 20 + RIGHT
    device = Device(Scripted(frames), pipeline, link)
    for _ in frames:
        device.advance(10.0)
    assert any(isinstance(message, Command) for message in link.sent)
    assert not any(isinstance(message, UserIdentified) for message in link.sent)


@pytest.mark.slow
def test_replays_name_users(path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    two = bundle.read(path)
    sensor = sensors.load("virtual", 10.0, seed=3)
    pipeline = Pipeline(two.settings, Recognizer(two), two.mapping)
    origin = Provenance(
        sensor.device_id, 5, 5, 10.0, 10.0, two.labels, two.hash, "onnxruntime", "test"
    )  # fmt: skip
    recording = tmp_path / "session.npz"
    tape = SessionRecorder(
        lambda state: Recorder(recording, origin, state), pipeline, Labeller(two.labels)
    )
    link = MessageLog()
    script = show(two.labels, sensor.geometry, seed=3)
    device = Device(sensor, pipeline, link, recorder=tape, hand=VirtualHand(script))
    for _ in range(300):
        device.advance(10.0)
    device.close()
    live = [message for message in link.sent if isinstance(message, UserIdentified)]
    assert len(live) > 3
    assert main(["--bundle", str(path), "--replay", str(recording)]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    said = [(line["user"], line["confidence"]) for line in lines if "user" in line]
    assert said == [(who.user, who.confidence) for who in live]
    assert any("command" in line for line in lines)


def test_only_enrolled_users_can_be_played(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--bundle", str(path), "--user", "eve"]) == 2
    assert "enrolled are ann, bob; add --record" in capsys.readouterr().err
    assert main(["--user", "eve"]) == 2
    assert "enrolled are none" in capsys.readouterr().err
