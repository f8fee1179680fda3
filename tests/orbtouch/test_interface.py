"""The public interface, used as a researcher uses it."""

import ast
import inspect
import re
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import orbtouch
from orbtouch import programs


@pytest.fixture(scope="module")
def session() -> orbtouch.Recording:
    return orbtouch.simulate(minutes=0.7, seed=3)


@pytest.fixture(scope="module")
def swipes() -> orbtouch.Recording:
    return orbtouch.simulate(minutes=1, gestures=("swipe", "press"), seed=5)


def test_a_recording_is_sliced_by_seconds(session: orbtouch.Recording) -> None:
    part = session[5.0:8.0]
    assert part.frames.shape == (120, 5, 5)
    assert part.t[0] >= 5.0
    assert part.t[-1] < 8.0
    assert part[6.0:7.0].duration == pytest.approx(1.0, abs=1.5 / 40)
    assert np.array_equal(part.frames, session.frames[(session.t >= 5.0) & (session.t < 8.0)])


def test_no_frame_in_a_slice_is_said_with_the_times_there_are(session: orbtouch.Recording) -> None:
    with pytest.raises(orbtouch.Error, match="no frame from 500 to 600 s; the recording has"):
        session[500.0:600.0]
    with pytest.raises(TypeError, match="by seconds"):
        session[3]  # type: ignore[index]


def test_gestures_are_the_runs_of_their_label(session: orbtouch.Recording) -> None:
    presses = list(session.gestures("press"))
    assert presses
    assert sum(map(len, presses)) == (session.labels == "press").sum()
    assert all((one.labels == "press").all() for one in presses)


def test_a_slice_is_saved_and_loaded(session: orbtouch.Recording, tmp_path: Path) -> None:
    session[2.0:9.0].save(tmp_path / "part.npz")
    again = orbtouch.load_recording(tmp_path / "part.npz")
    assert np.array_equal(again.frames, session[2.0:9.0].frames)
    assert (again.labels == session[2.0:9.0].labels).all()


def test_a_slice_gets_another_label_in_a_new_session(session: orbtouch.Recording) -> None:
    other = session[5.0:8.0].relabel("twist_cw")
    assert (other[5.0:8.0].labels == "twist_cw").all()
    assert (other[8.0:].labels == session[8.0:].labels).all()
    assert not (session[5.0:8.0].labels == "twist_cw").all()
    without = session[5.0:8.0].relabel(excluded=True)
    assert without._source.excluded.sum() == 120
    with pytest.raises(orbtouch.Error, match="there is no label 'jump'"):
        session[5.0:8.0].relabel("jump")


def test_a_missing_file_is_one_sentence() -> None:
    with pytest.raises(orbtouch.Error, match=r"nothing\.npz does not exist"):
        orbtouch.load_recording("nothing.npz")


def test_a_table_has_a_column_for_each_taxel(session: orbtouch.Recording) -> None:
    pytest.importorskip("pandas")
    table = session[2.0:3.0].to_pandas()
    assert list(table.columns[:2]) == ["r0c0", "r0c1"]
    assert table["r2c3"].to_numpy() == pytest.approx(session[2.0:3.0].frames[:, 2, 3])


def test_a_notebook_shows_plot_and_figures(session: orbtouch.Recording) -> None:
    assert "data:image/png;base64" in session._repr_html_()
    figures = orbtouch.load_network().evaluate([session])
    assert "<table>" in figures._repr_html_()
    assert "f1" in str(figures)


def test_the_shipped_network_answers_a_simulated_session(session: orbtouch.Recording) -> None:
    network = orbtouch.load_network()
    commands = network.run(session)
    assert {command.gesture for command in commands} <= set(network.classes)
    figures = network.evaluate([session])
    assert figures.events == sum(len(list(session.gestures(g))) for g in network.classes[1:])
    assert figures.f1.value > 0.9
    assert figures.confusion.sum() >= figures.events
    began, at = session.t.searchsorted([commands[0].t - 0.2, commands[0].t])
    during = network.probabilities(session)[began : at + 1]  # a press may be answered at its end
    assert during.argmax(axis=1).max() == network.classes.index(commands[0].gesture)


def test_a_recording_at_another_rate_is_refused() -> None:
    slow = orbtouch.simulate(minutes=0.2, rate_hz=25.0)
    with pytest.raises(orbtouch.Error, match=r"25\.00 Hz"):
        orbtouch.load_network().run(slow)


def test_five_slices_teach_a_gesture(swipes: orbtouch.Recording, tmp_path: Path) -> None:
    before = orbtouch.load_network()
    found = list(swipes.gestures("swipe"))
    after = before.teach("swipe", found[:5], command="hold")
    assert after.classes == (*before.classes, "swipe")
    assert before.classes == orbtouch.load_network().classes  # unchanged
    assert after.lesson is not None
    assert (after.lesson.examples, after.lesson.kept > 0.9) == (5, True)
    assert set(after.lesson.resembles) <= set(before.classes)
    after.save(tmp_path / "own.orb")
    again = orbtouch.load_network(tmp_path / "own.orb")
    later = swipes[found[5].t[0] - 1.0 :]
    answers = [one.name for one in again.run(later) if one.gesture == "swipe"]
    assert answers == ["hold"] * len(answers)
    assert len(answers) >= 0.8 * len(found[5:])


def test_a_slice_without_a_touch_teaches_nothing(session: orbtouch.Recording) -> None:
    with pytest.raises(orbtouch.Error, match="shows no touch"):
        orbtouch.load_network().teach("swipe", [session[1.5:2.0]], anyway=True)
    with pytest.raises(orbtouch.Error, match="no recording; give at least one"):
        orbtouch.load_network().teach("swipe", [])


def test_presses_are_no_swipes_unless_asked(session: orbtouch.Recording) -> None:
    presses = list(session.gestures("press"))[:3]
    with pytest.raises(orbtouch.Error, match=r"is no swipe: its recording labels it press; leave"):
        orbtouch.load_network().teach("swipe", presses)
    with pytest.raises(orbtouch.Error, match="its recording labels it null"):
        orbtouch.load_network().teach("swipe", [session[1.5:2.0]])
    bare = orbtouch.Recording.from_arrays(session.frames, rate_hz=40)
    with pytest.raises(orbtouch.Error, match="the network takes it for press"):
        orbtouch.load_network().teach("swipe", [bare[one.t[0] : one.t[-1]] for one in presses])


def test_the_parts_of_a_network_are_exported(tmp_path: Path) -> None:
    files = orbtouch.load_network().export(tmp_path / "parts")
    assert {"bundle.toml", "embedding.onnx"} <= {file.name for file in files}


def test_an_argument_out_of_range_is_named() -> None:
    with pytest.raises(orbtouch.Error, match=r"simulate has minutes = 0.*from 0\.1 to 1440"):
        orbtouch.simulate(minutes=0)
    with pytest.raises(orbtouch.Error, match="there is no gesture 'wave'"):
        orbtouch.simulate(minutes=0.1, gestures=("wave",))


def test_every_public_name_is_documented() -> None:
    for name in orbtouch.__all__:
        thing = getattr(orbtouch, name)
        assert inspect.getdoc(thing), name
        for own, member in vars(thing).items() if inspect.isclass(thing) else ():
            if not own.startswith("_") and (callable(member) or isinstance(member, property)):
                assert inspect.getdoc(member), f"{name}.{own}"


def public() -> Iterator[tuple[str, Callable[..., object]]]:
    """Yield public functions and methods by name."""
    for name in orbtouch.__all__:
        thing = getattr(orbtouch, name)
        if inspect.isfunction(thing):
            yield name, thing
        for own, member in vars(thing).items() if inspect.isclass(thing) else ():
            if not own.startswith("_") and inspect.isfunction(member):
                yield f"{name}.{own}", member


@pytest.mark.parametrize(("name", "thing"), [pytest.param(*one, id=one[0]) for one in public()])
def test_arguments_and_errors_of_a_public_name_are_described(
    name: str, thing: Callable[..., object]
) -> None:
    """Several arguments are listed, one or two are in the sentence; so are errors and results."""
    told = inspect.getdoc(thing) or ""
    sections = inspect.cleandoc(told).partition("\nArgs:")[2]
    names = [one for one in inspect.signature(thing).parameters if one not in ("self", "cls")]
    if len(names) > 2:
        assert [one for one in names if f"\n    {one}:" not in sections] == []
    if not name.endswith(("gestures", "touch", "draw", "close", "save")):
        assert re.search(r"[Rr]eturn|Draw", told.partition("\n\n")[0])
    body = ast.parse(textwrap.dedent(inspect.getsource(thing)))
    raised = [one for one in ast.walk(body) if isinstance(one, ast.Raise) and one.exc]
    assert not raised or re.search(r"Raises:|Error|needs", told), name


def test_arrays_are_described_by_shape_and_numbers_by_unit() -> None:
    for owner, members in {
        orbtouch.Recording: ("frames", "t", "labels"),
        orbtouch.Network: ("probabilities",),
        orbtouch.Orb: ("image",),
    }.items():
        for member in members:
            assert re.search(r"\((n|rows)\b[^)]*\)", inspect.getdoc(getattr(owner, member)) or "")
    for owner, attributes in {
        orbtouch.Command: ("t", "name", "gesture", "probability", "position"),
        orbtouch.Evaluation: tuple(orbtouch.Evaluation.__dataclass_fields__)[:-1],
        orbtouch.Lesson: tuple(orbtouch.Lesson.__match_args__),
        orbtouch.Training: tuple(orbtouch.Training.__dataclass_fields__),
        orbtouch.Windows: tuple(orbtouch.Windows.__match_args__),
    }.items():
        told = "".join(inspect.getdoc(one) or "" for one in owner.__mro__[:-1])
        assert [one for one in attributes if f"\n    {one}:" not in told] == []


def test_the_import_costs_nothing_until_a_name_is_used() -> None:
    code = "import sys as s, orbtouch; h = s.modules; print('numpy' in h, orbtouch.load_recording)"
    words = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert words.stdout.startswith("False <function load_recording")
    assert set(orbtouch.__all__) <= set(dir(orbtouch))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = orbtouch.nothing


def test_a_foreign_package_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder `models` in the working directory hides ours when a program is run from there."""
    root = Path(programs.__file__).resolve().parents[1]
    assert programs.foreign(root) == ""
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "models", raising=False)
    assert str(tmp_path / "models") in programs.foreign(root)
    assert programs.foreign(root).startswith("the package 'models' that Python finds is not")


def test_a_session_too_short_for_a_gesture_is_a_recording_all_the_same() -> None:
    made = [orbtouch.simulate(minutes=0.1, seed=seed) for seed in range(8)]
    assert any(set(one.labels.tolist()) == {"null"} for one in made)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_five_swipes_teach_swipes_of_every_direction(seed: int) -> None:
    """As docs/researcher.md prints it; nobody says which symmetries a swipe has."""
    waves = orbtouch.simulate(gestures=("press", "swipe"), seed=seed)
    mine = orbtouch.load_network().teach("swipe", list(waves.gestures("swipe"))[:5], command="hold")
    other = orbtouch.simulate(minutes=3, gestures=("press", "swipe"), seed=seed + 10)
    done = mine.evaluate([other]).confusion[mine.classes.index("swipe")]
    assert done[mine.classes.index("swipe")] >= 0.93 * done.sum()


def test_an_unknown_keyword_of_a_sensor_is_named(tmp_path: Path) -> None:
    with pytest.raises(orbtouch.Error, match="no option 'sed'; there are bundle, fault"):
        orbtouch.connect(sed=7)
    with pytest.raises(orbtouch.Error, match="those of a virtual orb; leave them out"):
        orbtouch.connect("/dev/rfcomm0", seed=7)
