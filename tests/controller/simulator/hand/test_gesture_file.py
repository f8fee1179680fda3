"""Gestures are data: what a file may say, what it means, and how a mistake in it is told."""

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.shared.config import parse_toml
from controller.simulator.hand.gesture import Count, Gesture, GestureError, Known, Quantity
from controller.simulator.hand.gesture_file import label_in, load, parse, shipped
from controller.simulator.hand.performance import DISTRACTORS, GESTURES, perform
from controller.simulator.hand.user_style import draw_style
from tests.support import ROOT

RNG = np.random.default_rng
STYLE = draw_style(RNG(0))

TAP = """
label = "tap"
phases = ["down", "hold", "up"]

[vary]
down = 0.1
hold = [0.2, 0.3]
up = 0.1

[path]
depth = [0, 5, 5, 0]
"""


def gesture(text: str) -> Gesture:
    """The one gesture in this text."""
    [made] = parse({"mine.toml": parse_toml(text)}).values()
    return made


def test_the_papers_gestures_and_three_more_ship() -> None:
    known = shipped()
    assert {label for label, g in known.items() if g.distractor} == set(DISTRACTORS)
    others = {label for label, g in known.items() if g.usual} - set(GESTURES)
    assert others == {"double_tap", "swipe", "squeeze"}
    assert {g.form_of for g in known.values() if g.form_of} == set(GESTURES)


def test_a_key_stands_at_every_boundary_between_two_phases() -> None:
    points, depth, radius = gesture(TAP).move(STYLE, RNG(1), step_hz=100.0)
    assert 40 < len(depth) <= 51  # down, hold and up: 0.4 to 0.5 s, 100 steps a second
    assert depth[0, 0] == 0.0
    assert depth[5, 0] == pytest.approx(2.5)  # half way down, at half time
    assert (depth[10:31, 0] == 5.0).all()
    assert depth[-1, 0] == pytest.approx(0.0, abs=0.01)
    assert not points.any()
    assert radius.tolist() == [STYLE.finger_radius]


def test_two_keys_are_an_even_motion_from_begin_to_end() -> None:
    slide = gesture(TAP + "x = [0, 10]\ny = [3]\n")
    points, _, _ = slide.move(STYLE, RNG(1), step_hz=50.0)
    steps = np.diff(points[:, 0].real)
    np.testing.assert_allclose(steps, steps[0])
    assert (points.imag == 3.0).all()


def test_fingers_stand_as_the_file_says() -> None:
    def standing(lines: str, fingers: int = 3) -> list[complex]:
        text = TAP.replace("[path]", f"fingers = {fingers}\n[path]") + lines
        points, _, _ = gesture(text).move(STYLE, RNG(1), 50.0)
        return [complex(p) for p in points[0].round(6)]

    assert standing("reach = [10]\nangles = [0, 90, 180]\n") == [10, 10j, -10]
    assert standing("line = 8\n") == [-8, 0, 8]
    assert standing("line = 8\nyaw = 90\n") == [-8j, 0, 8j]
    thumb, *others = standing("reach = [10]\nfan = 30\n", fingers=4)
    assert thumb == -10
    angles = [round(float(np.degrees(np.angle(other)))) for other in others]
    assert angles == [-30, 0, 30]


def test_a_quantity_is_drawn_anew_for_each_event_and_finger() -> None:
    rng = RNG(3)

    def many(line: Quantity, fingers: int = 1, left: bool = False) -> NDArray[np.float64]:
        known: Known = {"grip": 20.0, "gain": np.array([1.0, 2.0])}
        return np.array([line.draw(known, fingers, left, rng) for _ in range(4000)])

    even = many(Quantity((2.0, 5.0)))
    assert (even.min() > 2.0, even.max() < 5.0, round(even.mean(), 1)) == (True, True, 3.5)
    assert many(Quantity("grip", scatter=0.1)).std() == pytest.approx(2.0, rel=0.1)
    assert many(Quantity(1.0, jitter=0.5)).std() == pytest.approx(0.5, rel=0.1)
    assert many(Quantity(30.0, handed=True), left=True).tolist() == [150.0] * 4000
    assert many(Quantity("grip", times="-gain"), 2)[0].tolist() == [-20, -40]
    delay = many(Quantity(delay=0.04), 2)
    assert delay.shape == (4000, 2)
    assert (delay >= 0.0).all()
    assert np.abs(delay[:, 0] - delay[:, 1]).min() > 0.0
    assert many(Quantity((0.0, 9.0), least=2.0, most="grip")).min() == 2.0


def test_the_number_of_fingers_varies_as_declared() -> None:
    rng = RNG(4)

    def shares(line: Count) -> dict[int, float]:
        counted = Counter(line.draw({"twist_fingers": 4.0}, rng) for _ in range(4000))
        return {n: round(k / 4000, 1) for n, k in sorted(counted.items())}

    assert shares(Count(2.0, one_more=0.3)) == {2: 0.7, 3: 0.3}
    assert shares(Count((1.0, 2.0))) == {1: 0.5, 2: 0.5}
    assert shares(Count("twist_fingers", off_by_one=0.4)) == {3: 0.2, 4: 0.6, 5: 0.2}
    assert shares(Count(1.0, off_by_one=1.0)) == {1: 0.5, 2: 0.5}  # never none


def test_a_users_file_is_performed_beside_those_that_ship(tmp_path: Path) -> None:
    path = tmp_path / "tap.toml"
    path.write_text(TAP)
    known = load([path])
    assert set(known) == {*shipped(), "tap"}
    assert label_in(path) == "tap"
    done = perform("tap", (2.0, 2.0), STYLE, RNG(0), repertoire=known)
    assert done.depth_mm.max() == 5.0


def test_the_example_of_the_documentation_works() -> None:
    page = (ROOT / "docs" / "gestures.md").read_text(encoding="utf-8")
    [example] = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    knock = gesture(example)
    points, depth, _ = knock.move(STYLE, RNG(0), 50.0)
    assert depth.shape[1] == 2
    assert np.abs(points[0, 0] - points[0, 1]) == pytest.approx(18.0)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('"tap"', '"Tap"', "mine.toml has label = 'Tap'; write a name of small letters"),
        ("phases", "phase = 3\nphases", "unknown key 'phase'; known are label"),
        ('"up"]', '"off"]', "phases names 'off', which is neither a user's parameter nor"),
        ('["down", "hold", "up"]', "[]", "phases is \\[\\]; write a list"),
        ("down = 0.1", 'down = "up"', "down names 'up', which is neither"),
        ("down = 0.1", "down = [3, 2]", "write a number, a name in quotes, or \\[least, most\\]"),
        ("down = 0.1", "down = { off = 1 }", "unknown key 'off'; known are of"),
        ("down = 0.1", "down = { of = 1, delay = 1 }", "starts twice"),
        ("down = 0.1", "down = { scatter = -1 }", "scatter = -1.0; expected is"),
        ("down = 0.1", "down = 0", "divides by a phase of no time"),
        ("down = 0.1", "press_depth = 3", "is a user's parameter already"),
        ("down = 0.1", "down = { delay = 1 }\nfingers = 2", "move it up"),
        ("down = 0.1", "down = 0.1\nfingers = { of = 1, one_more = 2 }", "a number from 0 to 1"),
        ("down = 0.1", "down = 0.1\nfingers = { of = 8, most = 8 }", "8 fingers"),
        ("down = 0.1", "down = 1e9", "phases last 1e\\+09 s; at most 20"),
        ("depth", "width", "\\[path\\] has 'width', which is unknown"),
        ("depth = [0, 5, 5, 0]", "", "depth has 0 keys"),
        ("[0, 5, 5, 0]", "[0, 5, 0]", "depth has 3 keys"),
        ("[0, 5, 5, 0]", "[0, 5, 5, 1]", "the first and the last of them 0"),
        ("[0, 5, 5, 0]", "[0, 50, 50, 0]", "50.0 mm of depth"),
        ("[0, 5, 5, 0]", "[0, [1, 2], 5, 0]", "draw it in \\[vary\\] and name it"),
        ("[path]", "[path]\nreach = [1, 2, 3]", "reach has 3 keys; write 1"),
        ("[path]", "fingers = 3\n[path]\nreach = [9]\nangles = [0, 90]", "2 angles for 3"),
        ("[path]", "[path]\nangles = []", "angles is \\[\\]"),
        ("[path]", "[path]\nx = 3", "x is 3; write a list"),
        ("[path]\n", "[[path]]\n", "write a table"),
    ],
)
def test_a_mistake_is_one_sentence_that_says_where(old: str, new: str, sentence: str) -> None:
    assert old in TAP
    with pytest.raises(GestureError, match=sentence) as caught:
        gesture(TAP.replace(old, new, 1))
    assert str(caught.value).startswith("mine.toml")
    assert "\n" not in str(caught.value)


def test_files_must_fit_together(tmp_path: Path) -> None:
    with pytest.raises(GestureError, match="are both 'tap'; rename one"):
        parse({"a.toml": parse_toml(TAP), "b.toml": parse_toml(TAP)})
    with pytest.raises(GestureError, match="is like 'swing', which is no gesture"):
        parse({"a.toml": {"label": "a", "like": "swing"}})
    with pytest.raises(GestureError, match=r"cannot read .*absent\.toml: no such file"):
        load([tmp_path / "absent.toml"])
    (tmp_path / "broken.toml").write_text('label = "tap')
    with pytest.raises(GestureError, match=r"broken.toml, line 1: unterminated string"):
        load([tmp_path / "broken.toml"])
