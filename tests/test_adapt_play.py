"""That was a twist: what a player says of the latest touch is learned while play goes on."""

from pathlib import Path

import numpy as np
import pygame
import pytest
from bench import FINGER, Bench

from controller import bundle as bundles
from controller.adapt import AdaptError, correction
from controller.protocol import DECLINED, IN_USE, PROVING, Contacts, Correct, Delivery, Telemetry
from controller.shelf.clerk import Clerk
from controller.shelf.intake import Intake
from controller.shelf.shelf import Entry, Shelf, name_of
from host.correcting import Correcting

RATE_HZ = 10.0
SHIPPED = bundles.default_path()


def images(*touches: tuple[int, int], frames: int = 40) -> np.ndarray:
    """Rest, and a finger in the middle from one frame to another."""
    rng = np.random.default_rng(0)
    z = 1.0 + 0.003 * rng.normal(size=(frames, 5, 5))
    for first, end in touches:
        z[first:end, 1:4, 1:4] -= 0.2
        z[first:end, 2, 2] -= 0.2
    return z.astype(np.float32)


def test_the_latest_touch_is_meant() -> None:
    cut = correction.latest(images((8, 13), (25, 31)), RATE_HZ)
    assert cut is not None
    assert len(cut) == 27  # from 13 frames before it, but not from within the touch before
    span = correction.example("pinch", images((8, 13), (25, 31)), RATE_HZ).found()
    assert span is not None


def test_two_taps_in_a_row_are_one_touch() -> None:
    cut = correction.latest(images((22, 25), (27, 30)), RATE_HZ)
    assert cut is not None
    assert len(cut) == 40 - (22 - 13)


@pytest.mark.parametrize("seen", [images(), images((2, 8)), images(frames=2)])
def test_what_was_long_ago_or_never_is_refused(seen: np.ndarray) -> None:
    with pytest.raises(AdaptError, match="nothing touched the orb"):
        correction.example("pinch", seen, RATE_HZ)


def copied(path: Path, shelf: Shelf) -> str:
    """Take a bundle into use without a proof, which the shelf's own tests look at."""
    data = path.read_bytes()
    name = name_of(bundles.parse(data))
    shelf.install(data, Entry(name, "numpy", 1.0, "now"))
    return name


def test_a_correction_is_learned_in_a_process_of_its_own_and_can_be_taken_back(
    tmp_path: Path,
) -> None:
    shelf = Shelf(tmp_path)
    seen = images((25, 31))
    told = correction.correct("twist_cw", seen, RATE_HZ, shelf, lambda path: copied(path, shelf))
    assert told == "learned: that was twist_cw"
    now = bundles.read(shelf.current()[0])
    assert now.card["added"] == ["corrected in play: twist_cw"]
    assert now.labels == bundles.read(SHIPPED).labels
    back = correction.correct("", seen, RATE_HZ, shelf, lambda path: copied(path, shelf))
    assert back == "taken back; the shipped bundle is in use"
    with pytest.raises(AdaptError, match="no correction to take back"):
        correction.correct("", seen, RATE_HZ, shelf, lambda path: copied(path, shelf))
    assert not list((tmp_path / "incoming").iterdir())


def outcome(clerk: Clerk) -> Delivery | None:
    """What the clerk says when its thread has ended."""
    assert clerk._thread is not None
    clerk._thread.join()
    return clerk.poll()


def test_the_loop_hears_at_once_and_again_when_it_is_learned(tmp_path: Path) -> None:
    asked = []

    def learn(label: str, seen: list[np.ndarray]) -> str:
        asked.append((label, len(seen)))
        return "learned"

    clerk = Clerk(Intake(tmp_path), lambda path: "", learn)
    assert clerk.correct(Correct("pinch"), list(images())) == Delivery(PROVING, 0, "learning")
    assert outcome(clerk) == Delivery(IN_USE, 0, "learned")
    assert asked == [("pinch", 40)]
    assert clerk.switched


def test_a_link_that_does_not_prove_who_is_there_corrects_nothing(tmp_path: Path) -> None:
    clerk = Clerk(Intake(tmp_path, "no key"), lambda path: "", lambda label, seen: "")
    assert clerk.correct(Correct("pinch"), []) == Delivery(DECLINED, 0, "no key")


def test_what_cannot_be_learned_is_told_and_play_goes_on(tmp_path: Path) -> None:
    def learn(label: str, seen: list[np.ndarray]) -> str:
        raise AdaptError("that touch is too weak to learn from")

    clerk = Clerk(Intake(tmp_path), lambda path: "", learn)
    clerk.correct(Correct("pinch"), [])
    assert outcome(clerk) == Delivery(DECLINED, 0, "that touch is too weak to learn from")
    assert not clerk.switched


def test_keys_with_control_name_the_gestures_of_the_panel() -> None:
    keys = Correcting()
    assert not keys.key(pygame.K_1, pygame.KMOD_CTRL, 0.0)  # no orb is there yet
    keys.labels = ("null", "press", "pinch")
    assert not keys.key(pygame.K_2, 0, 0.0)  # two fingers, as ever
    assert not keys.key(pygame.K_3, pygame.KMOD_CTRL, 0.0)
    for code, label in ((pygame.K_2, "pinch"), (pygame.K_0, "null"), (pygame.K_BACKSPACE, "")):
        assert keys.key(code, pygame.KMOD_LCTRL, 1.0)
        assert keys.outgoing() == [Correct(label)]
        assert keys.outgoing() == []
    keys.answer(Delivery(PROVING, 0, "learning"), 2.0)
    assert keys.told(30.0) == "learning"
    keys.answer(Delivery(IN_USE, 0, "learned: that was pinch"), 31.0)
    assert keys.told(32.0) == "learned: that was pinch"
    assert keys.told(40.0) == ""


def test_the_loop_hands_over_the_latest_images_and_is_told_to_switch() -> None:
    """It never waits: the clerk answers at once, and ends the loop when it has learned."""
    given: list[tuple[str, int]] = []

    class Patient(Clerk):
        polled = 0

        def __init__(self) -> None:
            self.switched = False

        def correct(self, message: Correct, images: list[np.ndarray]) -> Delivery:
            given.append((message.label, len(images)))
            return Delivery(PROVING, 0, "learning")

        def poll(self) -> Delivery | None:
            if not given:
                return None
            self.polled += 1
            if self.polled < 20:
                return None
            self.switched = True
            return Delivery(IN_USE, 0, "learned")

    bench = Bench((3.0, FINGER), (4.0, Contacts(())), (6.05, Correct("pinch")))
    bench.loop._clerk = Patient()
    bench.run(20.0)
    assert given == [("pinch", 40)]  # four seconds of images
    said = bench.messages(Delivery)
    assert said == [Delivery(PROVING, 0, "learning"), Delivery(IN_USE, 0, "learned")]
    frames = [m.frame for m in bench.messages(Telemetry) if isinstance(m, Telemetry)]
    assert frames == list(range(1, len(frames) + 1))  # none was missed meanwhile
