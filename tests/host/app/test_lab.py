"""The lab: its ring buffers, the quality of taxels, and the screen."""

import os
from collections.abc import Iterator

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

import numpy as np
import pygame
import pytest

from controller.shared.protocol.codec import quantise_image
from controller.shared.protocol.messages import COMMANDS, Message, Telemetry, Welcome
from controller.shared.protocol.teaching import InjectFault, Record, RecordingStatus, Vocabulary
from controller.shared.taxel_measures import noise, noisy
from controller.simulator.dome.faults import KINDS
from host.app.application import OrbApp
from host.app.lab_data import FRAMES, IMAGE_STEP, NOISE_RATIO, SECONDS, LabData
from host.app.screens.lab import FAULTS, LabScreen
from host.connection.receiver import Connected, Delivered
from host.targets import SIZE
from tetris.engine.game import Phase
from tetris.kit.language import load
from tetris.kit.menu import MenuStep
from tetris.window.app import Start

LABELS = ("null", "press")
WELCOME = Welcome(1, 7, "virtual-1", "OrbTouch", True, 5, 5, 10.0, 40.0, 100, 300, LABELS, COMMANDS)


def frame(change: float = 0.0, press: float = 0.0) -> Telemetry:
    image = quantise_image([1.0 + change] * 25)
    return Telemetry(1, image, (1 - press, press), None, "", True, 40.0)


def buffer() -> LabData:
    data = LabData()
    data.connected(WELCOME)
    return data


def test_buffer_returns_the_last_seconds_oldest_first() -> None:
    data = buffer()
    for second in range(15):
        data.step(frame(0.01 * second), float(second))
    times_s, images, shares = data.recent(14.0)
    assert list(times_s) == [*range(15 - int(SECONDS), 15)]
    assert images[-1, 0, 0] == pytest.approx(0.14)
    assert shares.shape == (len(times_s), len(LABELS))


def test_buffer_that_is_full_forgets_the_oldest() -> None:
    data = buffer()
    for number in range(FRAMES + 3):
        data.step(frame(), number / 1000)
    times_s, _, _ = data.recent(1.0)
    assert len(times_s) == FRAMES
    assert times_s[0] == pytest.approx(0.003)
    assert (np.diff(times_s) > 0).all()


def test_probabilities_begin_anew_with_other_gestures() -> None:
    data = buffer()
    data.step(frame(press=0.5), 0.0)
    data.take(Vocabulary(("null", "press", "wave"), (), "", False, 0, ""), 0.0)
    data.step(Telemetry(1, bytes([128] * 25), (0.2, 0.0, 0.8), None, "", True, 40.0), 0.1)
    assert data.recent(0.1)[2].tolist() == [[0.0, 0.0, 0.0], pytest.approx([0.2, 0.0, 0.8])]


def test_image_of_another_shape_is_left_out() -> None:
    data = buffer()
    data.step(Telemetry(1, bytes([128] * 16), (1.0, 0.0), None, "", True, 40.0), 0.0)
    assert len(data.recent(0.0)[0]) == 0


def test_quality_marks_the_noisy_taxel() -> None:
    rng = np.random.default_rng(1)
    images = rng.normal(0.0, 0.003, (400, 5, 5)).astype(np.float32)
    assert not noisy(noise(images), NOISE_RATIO, IMAGE_STEP / 2).any()
    images[100:140] -= 0.1
    images[:, 1, 2] += rng.normal(0.0, 0.03, 400)
    assert np.argwhere(noisy(noise(images), NOISE_RATIO, IMAGE_STEP / 2)).tolist() == [[1, 2]]


def test_faults_are_those_of_the_virtual_orb() -> None:
    places = {"rows": "row", "columns": "column"}
    assert {kind: places.get(k.place, k.place) for kind, k in KINDS.items()} == FAULTS
    assert all(f"fault.{kind}" != load("de")(f"fault.{kind}") for kind in FAULTS)


@pytest.fixture
def app() -> Iterator[OrbApp]:
    pygame.display.init()
    app = OrbApp(Start("zen", 1), sound=False)
    app.tick(0.0, [Connected(WELCOME)])
    yield app
    pygame.display.quit()


def key(app: OrbApp, code: int, now_s: float) -> None:
    app.handle(pygame.event.Event(pygame.KEYDOWN, key=code), now_s)
    app.tick(now_s)


def sent(app: OrbApp) -> list[Message]:
    return [m for m in app.outgoing(5.0) if isinstance(m, Record | InjectFault)]


def test_f2_shows_the_lab_over_a_paused_game_and_leaves_it(app: OrbApp) -> None:
    app.tick(5.0)
    game = app.game.game
    assert game
    key(app, pygame.K_F2, 5.1)
    assert isinstance(app.stage.screen, LabScreen)
    assert game.phase is Phase.PAUSED
    app.tick(5.2, [Delivered(frame(), 0)])
    app.draw(pygame.Surface(SIZE))
    key(app, pygame.K_F2, 5.3)
    assert not isinstance(app.stage.screen, LabScreen)
    assert game.phase is Phase.PAUSED


def test_lab_asks_for_recording_and_faults(app: OrbApp) -> None:
    app.tick(5.0)
    key(app, pygame.K_F2, 5.1)
    screen = app.stage.screen
    assert isinstance(screen, LabScreen)
    record, fault = screen.menu.items[:2]
    assert record.do
    assert fault.step
    record.do()
    app.tick(5.2, [Delivered(RecordingStatus(True, "recording to /data/r.npz"), 0)])
    assert screen.menu.items[0].hint == "recording to /data/r.npz"
    fault.step(1)
    screen.rebuild()
    taxel = screen.menu.items[2]
    assert taxel.step
    taxel.step(-1)
    fault.step(-1)
    assert sent(app) == [
        Record(True), InjectFault("dead", 0, 0), InjectFault("dead", 4, 4), InjectFault("", 4, 4),
    ]  # fmt: skip
    screen.nav(MenuStep.BACK, 5.3)
    assert app.stage.screen is not screen
