"""A new gesture from a few examples is learned, the old ones stay, and a bundle comes of it."""

import math
from functools import cache

import numpy as np
import pytest

from controller import adapt
from controller.adapt import AdaptError, Example, few_shot, lessons
from controller.adapt.examples import denoised, paced, touched, vary
from controller.bundles import bundle as bundles
from controller.bundles import container
from controller.bundles.bundle import Bundle
from controller.bundles.container import BundleError
from controller.bundles.head import EVERYBODY
from controller.bundles.inference.networks import Recognizer, gestures_of
from controller.recognition.images.preprocess import Preprocessor
from controller.shared import npz
from controller.simulator.hand.user_style import person
from controller.simulator.orb import preset
from controller.simulator.session import simulate
from tests.support import user_bundles

SHIPPED = bundles.default_path(10.0)
LOADED = bundles.read(SHIPPED)
DATA = SHIPPED.read_bytes()


@pytest.fixture(autouse=True)
def _short_lessons(monkeypatch: pytest.MonkeyPatch) -> None:
    """Vary less than a device does: seconds are enough there, not here."""
    monkeypatch.setattr(few_shot, "COPIES", 60)


@cache
def examples(label: str, number: int, user: int = 3) -> tuple[Example, ...]:
    """Examples of a simulated gesture, cut a little before and after it."""
    played = simulate(
        np.random.SeedSequence([1, user]).spawn(5), 0.6, style=person(1, user), rate_hz=10.0,
        model=preset("nominal"), protocol="free", gestures=(label,),
    )  # fmt: skip
    stage = Preprocessor(LOADED.preprocess, 5, 5)
    images = np.array([stage.step(frame).image for frame in played.frames])
    found = []
    for event in played.events:
        first, end = np.searchsorted(played.time_s, (event.onset_s - 1.5, event.release_s + 0.4))
        if event.onset_s > 3.0:
            cut = images[first:end]
            found.append(Example(label, cut, rotations="all", mirrored=True))
    return tuple(found[:number])


@cache
def taught() -> bytes:
    """The shipped bundle after three double taps."""
    made = adapt.teach(DATA, examples("double_tap", 3), command="hold")
    return written(made)


def written(made: adapt.AdaptedBundle) -> bytes:
    return bundles.assembled(made.manifest, made.parts)


def named(loaded: Bundle, windows: np.ndarray) -> list[str]:
    return [loaded.labels[k] for k in gestures_of(loaded)(windows).argmax(axis=1)]


def found(one: Example, rate_hz: float = 10.0) -> Example:
    """An example whose touch has been found."""
    example = one.found(rate_hz)
    assert example is not None
    return example


def span(one: Example) -> tuple[float, float]:
    assert one.span is not None
    return one.span


def test_three_double_taps_make_a_bundle_that_knows_double_taps() -> None:
    learned = bundles.parse(taught())
    assert learned.labels == (*LOADED.labels, "double_tap")
    assert learned.mapping.command("double_tap", None) == "hold"
    assert learned.card["added"] == ["double_tap from 3 examples"]
    assert learned.location_onnx == LOADED.location_onnx
    assert learned.embedding_onnx == LOADED.embedding_onnx
    Recognizer(learned)
    another = found(examples("double_tap", 5)[4])
    windows, telling = vary(another, 10, 1, np.random.default_rng(0))
    late = named(learned, windows[telling >= 0.9])
    assert late.count("double_tap") > len(late) / 2


@pytest.mark.parametrize(("later", "beside"), [(40, 0.0), (0, 0.2)])
def test_a_gesture_whose_contacts_begin_one_after_another_is_seen_as_a_whole(
    later: int, beside: float
) -> None:
    """Else the second would be seen alone, as a press."""
    data, rng = bundles.default_path(40.0).read_bytes(), np.random.default_rng(1)
    taught = []
    for _ in range(3):
        images = 1.0 + rng.normal(0.0, 0.005, (160, 5, 5))
        images[40:120, 0:2, 0:2] -= 0.2
        images[40 + later : 120, 3:5, 3:5] -= 0.25
        taught.append(Example("chord", images.astype(np.float32)))
    made = bundles.parse(written(adapt.teach(data, taught, command="hold")))
    assert made.preprocess.beside == beside


def test_the_old_gestures_stay() -> None:
    learned = bundles.parse(taught())
    before, after = named(LOADED, LOADED.golden.windows), named(learned, LOADED.golden.windows)
    same = [one == other for one, other in zip(before, after, strict=True)]
    assert sum(same) >= len(same) - 4  # frames at an edge may go either way


def test_the_same_lesson_makes_the_same_bundle() -> None:
    assert written(adapt.teach(DATA, examples("double_tap", 3), command="hold")) == taught()


def test_what_was_trained_is_still_there_under_what_was_learned() -> None:
    before, after = container.unpack(DATA), container.unpack(taught())
    changed = {name for name in after if after[name] != before.get(name)}
    assert changed == {container.MANIFEST, container.TAUGHT, container.SUMS}
    learned = bundles.parse(taught())
    whole, rows = learned.head_of(), learned.taught[EVERYBODY]
    assert np.array_equal(whole.hidden, np.concatenate([LOADED.head.hidden, rows.hidden]))
    width = len(LOADED.head.hidden)
    assert np.array_equal(whole.out[:5, :width], LOADED.head.out)
    assert not whole.out[5:, :width].any()


def test_of_an_old_gesture_that_is_taught_anew_the_network_that_learned_it_decides() -> None:
    anew = bundles.parse(written(adapt.teach(DATA, examples("press", 2))))
    assert anew.contact.taught == ("press",)
    assert bundles.parse(taught()).contact.taught == ()  # no other network knows a double tap


def test_a_second_gesture_keeps_the_first_and_the_network_s_size() -> None:
    made = written(adapt.teach(taught(), examples("squeeze", 3)))
    learned = bundles.parse(made)
    assert learned.labels[-2:] == ("double_tap", "squeeze")
    assert learned.mapping.command("squeeze", None) is None
    assert len(learned.card["added"]) == 2
    for label in ("double_tap", "squeeze"):
        one = found(examples(label, 1)[0])
        windows, telling = vary(one, 10, 1, np.random.default_rng(0))
        assert label in named(learned, windows[telling >= 0.9])
    first = bundles.parse(taught()).taught[EVERYBODY]
    assert learned.taught[EVERYBODY].hidden.shape == first.hidden.shape


@pytest.mark.slow
def test_a_person_s_own_gesture_goes_into_rows_of_their_own() -> None:
    theirs = [Example("pinch", one.images, user="ann") for one in examples("squeeze", 2)]
    first = written(adapt.teach(DATA, theirs))
    learned = bundles.parse(first)
    assert learned.labels == LOADED.labels
    assert (learned.users.names, list(learned.taught)) == (("ann",), ["ann"])
    assert learned.card["added"] == ["pinch of ann from 2 examples"]
    asked, window = Recognizer(learned), LOADED.golden.windows[0]
    everybody = Recognizer(LOADED).probabilities(window)
    assert asked.probabilities(window) == pytest.approx(everybody)
    assert asked.probabilities(window, "ann") != pytest.approx(everybody)
    both = bundles.parse(written(adapt.teach(first, examples("double_tap", 1))))
    assert list(both.taught) == [EVERYBODY, "ann"]
    assert len(both.taught["ann"].out) == 6  # and her rows know the new gesture as well


def test_a_bundle_without_a_rehearsal_cannot_be_taught() -> None:
    parts = container.content(container.unpack(DATA))
    del parts[container.REHEARSAL]
    bare = bundles.assembled(container.unpack(DATA)[container.MANIFEST], parts)
    with pytest.raises(AdaptError, match="this bundle has nothing to rehearse"):
        adapt.teach(bare, examples("squeeze", 1))


def test_a_user_whom_the_bundle_cannot_identify_is_refused() -> None:
    data = bundles.assembled(user_bundles.manifest(), user_bundles.parts())
    theirs = [Example("pinch", one.images, user="cleo") for one in examples("squeeze", 1)]
    with pytest.raises(AdaptError, match="identifies its users by their touch, and does not know"):
        adapt.teach(data, theirs)


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ((), "there are no examples"),
        ((Example("wave", np.ones((20, 5, 5), np.float32)),), "example 1 of wave shows no touch"),
        ((Example("wave", np.ones((20, 4, 5), np.float32)),), "expected are some of 5×5 taxels"),
        ((Example("wave", np.ones((20, 5, 5), np.float32)),) * 201, "keeps at most 200"),
    ],
)
def test_what_cannot_be_learned_from_is_refused(given: tuple[Example, ...], complaint: str) -> None:
    with pytest.raises(AdaptError, match=complaint):
        adapt.teach(DATA, given)


def test_a_lesson_that_costs_the_old_gestures_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Presses of another name that count more than all else cannot be told from presses."""
    monkeypatch.setattr(few_shot, "NEW_SHARE", 5.0)
    same = [Example("poke", one.images, rotations="all") for one in examples("press", 4)]
    with pytest.raises(AdaptError, match="the other gestures would suffer"):
        adapt.teach(DATA, same)


def stretch(one: Example) -> tuple[str, np.ndarray]:
    """The windows of an example's touch, as those of a recording that was labelled."""
    windows, telling = vary(found(one), 10, 1, np.random.default_rng(0))
    return one.label, windows[telling > 0.0]


def test_a_lesson_that_costs_a_persons_own_old_gestures_is_refused_with_the_figure() -> None:
    """Their presses are taught by another name; the training's presses might stay."""
    theirs = examples("press", 14, user=5)
    poke = [Example("poke", one.images, rotations="all") for one in theirs[:5]]
    with pytest.raises(AdaptError, match=r"would suffer: \d+%"):
        adapt.teach(DATA, poke, own=[stretch(one) for one in theirs[5:]])


def test_a_persons_other_windows_are_kept_for_later_lessons() -> None:
    own = [stretch(one) for one in examples("press", 6, user=5)]
    first = written(adapt.teach(DATA, examples("squeeze", 3, user=5), own=own))
    kept = lessons.read(first).own
    assert set(kept.label.tolist()) == {"press"}
    assert len(set(kept.touch.tolist())) == 6
    again = lessons.read(written(adapt.teach(first, examples("double_tap", 2, user=5))))
    np.testing.assert_array_equal(again.own.touch, kept.touch)
    assert again.own.embedding == pytest.approx(kept.embedding, abs=0.1)


def test_examples_of_a_sensor_with_a_strong_signal_are_kept_whole() -> None:
    """On an orb z stays within .36 and 1.64, on a telephone's screen it is several."""
    strong = images_touched((10, 16), firm=-3.5)
    one = Example("tap", strong, span=(10.0, 16.0), edge=5.0)
    (kept,) = lessons.unpack(lessons.pack([one], (5, 5)))
    assert kept.images.max() == pytest.approx(4.5, abs=0.01)
    assert (kept.span, kept.edge) == (one.span, one.edge)


@pytest.mark.parametrize("name", ["embedding", "scale", "touch", "firmest"])
def test_a_rehearsal_of_another_bundle_is_refused(name: str) -> None:
    parts = container.content(container.unpack(DATA))
    arrays = npz.unpack(parts[container.REHEARSAL], container.MAX_BYTES)
    for other in (arrays[name][..., :-1], arrays[name].astype(np.float64)):
        parts[container.REHEARSAL] = npz.pack({**arrays, name: other})
        odd = bundles.assembled(container.unpack(DATA)[container.MANIFEST], parts)
        with pytest.raises(BundleError, match="rehearsal of another sensor"):
            adapt.teach(odd, examples("squeeze", 1))


def test_examples_of_another_sensor_are_refused() -> None:
    parts = container.unpack(taught())
    arrays = npz.unpack(parts[container.TAUGHT], container.MAX_BYTES)
    odd = {**arrays, "taught": arrays["taught"][:, :4]}
    content = {**container.content(parts), container.TAUGHT: npz.pack(odd)}
    data = bundles.assembled(parts[container.MANIFEST], content)
    with pytest.raises(BundleError, match="has examples of another sensor"):
        lessons.read(data)


def images_touched(*touches: tuple[int, int], frames: int = 40, firm: float = 0.5) -> np.ndarray:
    images = np.ones((frames, 5, 5), np.float32)
    for first, end in touches:
        images[first:end, 2, 2] -= firm
    return images


def test_a_double_tap_is_found_with_its_pause() -> None:
    one = found(Example("double_tap", images_touched((10, 13), (15, 18))))
    assert one.span == pytest.approx((9.3, 17.7), abs=0.35)
    assert len(one.images) == 40
    assert touched(np.ones((30, 5, 5), np.float32), 10.0) == []


def test_of_two_touches_only_the_last_is_learned() -> None:
    one = found(Example("tap", images_touched((3, 9), (20, 26), (35, 36))))
    begin, end = (math.ceil(edge) for edge in span(one))
    assert end - begin == 6
    assert (one.images[begin:end, 2, 2] == 0.5).all()
    around = np.concatenate([one.images[:begin], one.images[end:]])
    assert len(around) > 5
    assert (around == 1.0).all()


def test_an_example_begins_and_ends_at_the_quietest_frames_of_the_pauses() -> None:
    images = images_touched((3, 9), (20, 26), (35, 36))
    images[:, 0, 0] = 0.97
    images[[14, 30], 0, 0] = 1.0
    assert len(found(Example("tap", images)).images) == 30 + 1 - 14


def test_a_gap_within_a_touch_is_no_pause_before_it() -> None:
    images = images_touched((3, 9), (20, 23), (25, 28))
    images[:, 0, 0] = 0.97
    images[14, 0, 0] = 0.98
    images[23:25, 0, 0] = 1.0
    assert len(found(Example("double_tap", images)).images) == len(images) - 14


@pytest.mark.parametrize("rate_hz", [10.0, 50.0, 200.0])
def test_the_pause_that_parts_touches_is_a_time_not_frames(rate_hz: float) -> None:
    def at(*seconds: float) -> tuple[int, ...]:
        return tuple(round(rate_hz * s) for s in seconds)

    def touched_s(pause_s: float) -> float:
        touches = (at(1.0, 1.3), at(1.3 + pause_s, 1.6 + pause_s))
        images = images_touched(*touches, frames=round(4 * rate_hz))  # type: ignore[arg-type]
        begin, end = span(found(Example("tap", images), rate_hz))
        return (end - begin) / rate_hz

    assert touched_s(0.3) == pytest.approx(0.9, abs=0.1)
    assert touched_s(0.6) == pytest.approx(0.3, abs=0.1)


@pytest.mark.parametrize(("between", "touches"), [(3, 1), (4, 1), (5, 2)])
def test_touches_with_no_more_than_a_pause_between_them_are_one(between: int, touches: int) -> None:
    images = images_touched((10, 13), (13 + between, 16 + between))
    assert len(touched(images, 10.0)) == touches


def test_a_stray_after_the_touch_is_not_meant() -> None:
    images = images_touched((10, 16)) + images_touched((30, 32), firm=0.2) - 1.0
    one = found(Example("tap", images))
    assert one.span == pytest.approx((9.3, 15.7), abs=0.35)


def test_examples_of_a_noisy_orb_weigh_less() -> None:
    def weight(noise: float, rate_hz: float = 10.0) -> float:
        rng = np.random.default_rng(0)
        images = images_touched((10, 16)) + noise * rng.normal(size=(40, 5, 5))
        return few_shot.weight_of(Example("tap", images.astype(np.float32)), rate_hz)

    assert weight(0.0) == pytest.approx(few_shot.SHARE)
    # Normal noise changes by 2/sqrt(pi) of its deviation from frame to frame, on average.
    halving = few_shot.NOISY * np.sqrt(np.pi) / 2
    assert weight(halving) == pytest.approx(few_shot.SHARE / 2, rel=0.1)
    assert weight(2.0 * halving, 40.0) == pytest.approx(few_shot.SHARE / 2, rel=0.1)


def test_the_noise_of_an_example_is_drawn_anew_in_each_variation() -> None:
    """Else one example of a noisy orb would teach its noise as part of the gesture."""
    true = images_touched((40, 70), frames=110)
    errors = 0.1 * np.random.default_rng(0).normal(size=true.shape).astype(np.float32)
    clean, noise = denoised(true + errors, blurred=True)
    assert noise == pytest.approx(0.1, rel=0.1)
    assert np.sqrt(np.square(clean - true).mean()) < 0.3 * noise

    noisy = true + errors
    noisy[20, 0, 0] += 0.7
    one = found(Example("tap", noisy), 40.0)
    unchanged = len(vary(one, 40, 1, np.random.default_rng(1))[0])
    variations = vary(one, 40, 20, np.random.default_rng(1))[0][unchanged:]
    assert variations.max() < 1.8  # half of that one reading's error is left
    assert variations[:, :, 4, 4].std() == pytest.approx(0.1, rel=0.1)


def test_a_quiet_example_keeps_its_shape() -> None:
    quiet = images_touched((10, 13), (15, 18))
    clean, noise = denoised(quiet, blurred=False)
    assert noise == 0.0
    np.testing.assert_allclose(clean, quiet, atol=1e-6)


def test_a_short_touch_read_at_other_instants_keeps_its_tip() -> None:
    time = np.arange(20.0)
    depth = 0.3 * np.exp(-0.5 * np.square((time - 10.0) / 1.2))  # a knock at 10 Hz
    images = np.repeat(1.0 - depth, 25).reshape(20, 5, 5).astype(np.float32)
    rng, worst = np.random.default_rng(0), np.zeros(2)
    for _ in range(30):
        seen, at = paced(images, rng)
        true = 1.0 - 0.3 * np.exp(-0.5 * np.square((at - 10.0) / 1.2))
        line = np.interp(at, time, images[:, 0, 0])
        off = [np.abs(one - true).max() for one in (seen[:, 0, 0], line)]
        worst = np.maximum(worst, off)
    assert worst[0] < 0.5 * worst[1]


def test_examples_are_turned_only_as_they_declare() -> None:
    images = np.ones((20, 5, 5), np.float32)
    images[8:14, 0, 1] = 0.5  # the top row
    for rotations, rows in (("none", {0}), ("half", {0, 4}), ("all", {0, 1, 3, 4})):
        one = found(Example("tap", images, rotations=rotations))
        windows, telling = vary(one, 10, 30, np.random.default_rng(0))
        last = windows[telling > 0.9][:, -1]
        assert {int(np.unravel_index(z.argmin(), z.shape)[0]) for z in last} == rows
