"""Cost of a lesson: the simulated hand before it, after it, and without waiting."""

from pathlib import Path

import pytest
import tomli_w

from controller.adapt import cost, few_shot
from controller.bundles import bundle as bundles
from controller.bundles import container
from controller.simulator.orb import OrbModel
from tests.controller.adapt.test_few_shot import DATA, examples, written

HAND = cost.Hand(seed=3, quick=False)


@pytest.fixture(autouse=True)
def _few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cost, "TRIES_PER_GESTURE", 2)
    monkeypatch.setattr(few_shot, "COPIES", 60)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return a bundle that was taught double taps, for which a press waits."""
    made = few_shot.teach(DATA, examples("double_tap", 3), command="hold")
    path, parts = tmp_path / "taught.orb", container.unpack(written(made))
    table = container.manifest(parts[container.MANIFEST])
    table["debounce"] |= {"patient": ["press"], "awaited": ["double_tap"], "patience_s": 0.3}
    manifest = tomli_w.dumps(table).encode()
    bundles.write(path, manifest=manifest, parts=container.content(parts))
    return path


def test_the_hand_plays_each_gesture_as_often_and_always_alike() -> None:
    bundle = bundles.read(bundles.default_path(10.0))
    frames, events = cost.performed(bundle, bundle.labels[1:], HAND)
    kinds = [event.kind for event in events]
    assert {kind: kinds.count(kind) for kind in kinds} == dict.fromkeys(bundle.labels[1:], 2)
    assert cost.performed(bundle, bundle.labels[1:], HAND)[1] == events
    assert len(frames) > 10.0 * events[-1].release_s


def test_what_waits_comes_later_and_without_waiting_sooner(path: Path) -> None:
    costs = {one.label: one for one in cost.measure(path, "double_tap", HAND)}
    press = costs["press"]
    assert press.before.latency_s < press.eager.latency_s < press.now.latency_s, press
    assert costs["double_tap"].before == (0, 0.0)
    assert costs["double_tap"].now.hits > 0


def test_waiting_can_be_switched_off_and_on_again(path: Path) -> None:
    data = path.read_bytes()
    off = written(few_shot.waiting(data, "double_tap", wait=False))
    settings = bundles.parse(off).debounce
    assert (settings.eager, settings.awaited, settings.patient) == (("double_tap",), (), ())
    on = few_shot.waiting(off, "double_tap", wait=True)
    assert on.debounce.eager == ()


def test_an_orb_of_another_grid_is_played_by_examples_only() -> None:
    bundle = bundles.read(bundles.default_path(10.0))
    hand = cost.Hand(model=OrbModel(rows=7))
    assert cost.performed(bundle, bundle.labels[1:], hand) == ([], [])
