"""Slips of a newcomer: what is plain works, the rest is refused in one sentence."""

import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import orbtouch
from tests.support.pytest_types import Capture

PLAIN = "plain.npz"


@pytest.fixture(scope="module")
def session() -> orbtouch.Recording:
    return orbtouch.simulate(minutes=0.5, rate_hz=10.0, gestures=("press",))


@pytest.fixture(scope="module")
def net() -> orbtouch.Network:
    return orbtouch.load_network("models/orbtouch-10hz.orb")


def test_a_path_and_a_single_recording_are_taken(
    session: orbtouch.Recording, net: orbtouch.Network, tmp_path: Path
) -> None:
    path = tmp_path / "own.npz"
    session.save(path)
    assert net.run(path) == net.run(str(path)) == net.run(session)
    one = net.evaluate(session)
    assert one.events == net.evaluate([str(path)]).events
    assert one.confusion.tolist() == net.evaluate(path).confusion.tolist()


N = ("null",)


def presses(session: orbtouch.Recording) -> list[orbtouch.Recording]:
    return list(session.gestures("press"))


def uniform(windows: np.ndarray) -> np.ndarray:
    """No idea."""
    return np.full((len(windows), 5), 0.2)


def test_columns_in_any_order_and_names_of_files_have_one_meaning(
    session: orbtouch.Recording,
) -> None:
    def last(windows: np.ndarray) -> np.ndarray:
        return np.eye(len(classes))[[-1] * len(windows)]

    classes = (*session.classes[1:], "null")
    made = orbtouch.evaluate(last, session, classes=classes, debounce="models/orbtouch-10hz.orb")
    assert made.classes == session.classes
    assert made.confusion[1:, 0].sum() == made.events  # it always answers null


def test_two_threads_run_one_network(net: orbtouch.Network, session: orbtouch.Recording) -> None:
    with ThreadPoolExecutor(2) as pool:
        one, other = pool.map(net.run, (session, session))
    assert one == other == net.run(session)


REFUSED: list[tuple[str, Callable[[orbtouch.Network, orbtouch.Recording], object]]] = [
    (r"Recording\.from_arrays", lambda net, s: orbtouch.Recording(s.frames)),  # type: ignore[arg-type]
    ("a ndarray is no recording", lambda net, s: net.run(s.frames)),  # type: ignore[arg-type]
    ("a list is no recording", lambda net, s: net.run([s])),  # type: ignore[arg-type]
    ("a int is no recording", lambda net, s: net.evaluate([3])),  # type: ignore[list-item]
    ("there is no recording", lambda net, s: net.evaluate([])),
    ("hand = 'foot'", lambda net, s: orbtouch.simulate(hand="foot")),  # type: ignore[arg-type]
    ("minutes = '2'", lambda net, s: orbtouch.simulate(minutes="2")),  # type: ignore[arg-type]
    ("user = '1'", lambda net, s: orbtouch.simulate(user="1")),  # type: ignore[arg-type]
    ("epochs = '2'", lambda net, s: orbtouch.train("data", "a.orb", epochs="2")),  # type: ignore[arg-type]
    ("recipe = 'best'", lambda net, s: orbtouch.train("data", "a.orb", recipe="best")),
    ("a Recording is no path", lambda net, s: orbtouch.train([s], "a.orb")),  # type: ignore[list-item]
    ("a NoneType is no path", lambda net, s: orbtouch.load_recording(None)),  # type: ignore[arg-type]
    ("a int is no path", lambda net, s: orbtouch.load_network(3)),  # type: ignore[arg-type]
    ("a str is no bundle; use load_net", lambda net, s: orbtouch.Network("a.orb")),  # type: ignore[arg-type]
    ("the bundle is damaged", lambda net, s: orbtouch.Network(b"abc")),
    ("/: it is a folder", lambda net, s: s.save("/")),
    ("bundle has labels = .*small", lambda net, s: net.teach("Wave", presses(s), anyway=True)),
    ("rotations = 'turn'", lambda net, s: net.teach("wave", s, rotations="turn")),  # type: ignore[arg-type]
    ("window = 1; expected is a number from 2", lambda net, s: s.windows(1)),
    ("debounce is a int", lambda net, s: orbtouch.evaluate(uniform, s, debounce=3)),  # type: ignore[arg-type]
    ("base is a int", lambda net, s: orbtouch.live(uniform, base=3)),  # type: ignore[arg-type]
    ("type cannot be judged", lambda net, s: orbtouch.evaluate(Exception, s)),
    (
        "gesture 'press', which classes lack",
        lambda net, s: orbtouch.evaluate(uniform, s, classes=N),
    ),
    ("link = 3; expected is a port", lambda net, s: orbtouch.connect(3)),  # type: ignore[arg-type]
    ("duration = '2'; expected", lambda net, s: orbtouch.record("a.npz", "2")),  # type: ignore[arg-type]
    ("epochs 0 trains nothing; add from", lambda net, s: orbtouch.train("x", "a.orb", epochs=0)),
    (r"nothing\.orb", lambda net, s: orbtouch.train("x", "a.orb", from_="nothing.orb")),
    ("int cannot be judged", lambda net, s: orbtouch.evaluate(3, s)),
    ("two evaluations", lambda net, s: orbtouch.compare(net, net)),  # type: ignore[arg-type]
]


@pytest.mark.parametrize(("problem", "slip"), REFUSED, ids=[one[0] for one in REFUSED])
def test_a_slip_is_refused_in_one_sentence(
    problem: str,
    slip: Callable[[orbtouch.Network, orbtouch.Recording], object],
    net: orbtouch.Network,
    session: orbtouch.Recording,
) -> None:
    with pytest.raises(orbtouch.Error, match=problem) as found:
        slip(net, session)
    assert "\n" not in str(found.value)


def test_an_archive_of_plain_arrays_is_refused_with_the_way(tmp_path: Path) -> None:
    np.savez(tmp_path / "plain.npz", frames=np.ones((5, 5, 5)))
    with pytest.raises(orbtouch.Error, match=r"arrays become one by Recording\.from_arrays"):
        orbtouch.load_recording(tmp_path / "plain.npz")


def test_errors_have_their_public_name() -> None:
    with pytest.raises(orbtouch.Error) as found:
        orbtouch.load_recording("nothing.npz")
    kind = found.type
    assert f"{kind.__module__}.{kind.__qualname__}" == "orbtouch.Error"


def test_progress_is_logged_and_nothing_is_printed(
    net: orbtouch.Network,
    session: orbtouch.Recording,
    capsys: Capture,
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO, "orbtouch")
    events = net.evaluate(session).events
    assert f"of {events} event" in caplog.text
    assert capsys.readouterr() == ("", "")
