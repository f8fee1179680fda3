"""Data sets of an information study, and the measurement of their parts, in nats."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles import bundle
from controller.recordings import reader
from controller.recordings.recording import Recording
from controller.simulator.orb import PRESETS
from controller.simulator.session import TEST_SEEDS, simulate
from models import processes
from models.data.examples import Choice
from models.data.simulate import DataSet
from models.evaluation import bootstrap
from models.evaluation.replay import Batched
from models.results.figure import Figure
from models.studies.information import classifier_bound, histogram, knn, vocabulary
from models.studies.information.histogram import PAPER_FRAMES
from models.studies.information.results import Results, keep, load
from models.studies.information.windows import GAIN, Rest, Windows, as_the_paper, cut, fixed_ratio

SEED: Final = TEST_SEEDS.start + 20  # no training accepts it
DAYS: Final = 4  # of one person
MINUTES: Final = 6.0  # of each
PAPER_MINUTES: Final = 29.2  # two such sessions hold the paper's frames
PAPER_SEEDS: Final = 5  # people and orbs
BINS: Final = (5, 10, 25, 50, 100, 250, 1000)
COMPONENTS: Final = (1, 2, 3, 5, 8, 12, 20)
PLACE_COMPONENTS: Final = (2, 4, 6)
THEILER_S: Final = 2.0  # so close in time nothing is a neighbour, and nothing of the same touch
POINTS: Final = 5000  # at most, for neighbours
STEP: Final = 2  # from one window to the next
EPOCHS: Final = 30
LEAST: Final = 100  # presses: fewer give no information about places

Session = tuple[NDArray[np.float64], NDArray[np.int64]]  # z (frames, taxels), labels (frames,)


@dataclass(frozen=True, slots=True)
class RecordingSet:
    """Sessions that belong together.

    Attributes:
        name: Title of the set.
        paths: Files; none: people are simulated.
        preset: Quality of the simulated orbs.
        choice: Source of the labels.
        quick: A third of the simulated minutes, and one seed.
    """

    name: str
    paths: tuple[Path, ...] = ()
    preset: str = ""
    choice: Choice = "auto"
    quick: bool = False

    def recordings(self, **changes: Any) -> list[Recording]:
        """Return all sessions; simulated ones with some settings of `DataSet` changed."""
        if self.paths:
            return [reader.load(path) for path in self.paths]
        minutes = 2.0 if self.quick else MINUTES
        data = DataSet(seed=SEED, minutes=minutes, preset=self.preset, **changes)
        return [data.session(0, day) for day in range(DAYS)]

    def as_the_paper(self) -> list[Session]:
        """Return z and labels as section 6 has them; simulated ones of several seeds."""
        if self.paths:
            return [as_the_paper(self.recordings())]
        return [
            _paper_session(self.preset, seed) for seed in range(1 if self.quick else PAPER_SEEDS)
        ]


def simulated(quick: bool = False) -> list[RecordingSet]:
    """Return a set for each preset."""
    return [RecordingSet(preset, preset=preset, quick=quick) for preset in PRESETS]


def _paper_session(preset: str, seed: int) -> Session:
    """Return z, (PAPER_FRAMES, taxels), and the button's labels of one person's two sessions."""
    signals, labels = [], []
    for run in range(2):
        session = simulate(
            TEST_SEEDS.start + 10 * seed + run, PAPER_MINUTES, user=seed, model=PRESETS[preset],
            protocol="blocks",
        )  # fmt: skip
        signals.append(fixed_ratio(session.frames, 10.0).astype(np.float64))
        labels.append(session.button.astype(np.int64))
    return np.concatenate(signals)[:PAPER_FRAMES], np.concatenate(labels)[:PAPER_FRAMES]


def measure(
    sets: Sequence[RecordingSet],
    only: Sequence[str],
    workers: int,
    path: Path | None,
    say: Callable[[str], None],
) -> Results:
    """Return all results, measuring what the file does not hold.

    Args:
        sets: Data sets.
        only: First words of names of parts, or "none"; empty: all parts.
        workers: Processes.
        path: File of the results, written after each part, so that an interrupted study
            continues; None: nowhere.
        say: Takes lines of progress.
    """
    found, jobs = load(path), {}
    for one in sets:
        _drop_stale(found, one)
        for name, job in parts(one).items():
            key = f"{one.name}|{name}"
            if key not in found["parts"] and (not only or name.split()[0] in only):
                jobs[key] = job
    done = processes.completed(jobs, workers, hasty=True)
    for number, (key, result, left_s) in enumerate(done, 1):
        say(f"{number}/{len(jobs)} {key.replace('|', ': ')}; {left_s:.0f} s left")
        found["parts"][key] = result
        keep(path, found)
    return found


def _drop_stale(found: Results, one: RecordingSet) -> None:
    """Remove the results of a set that were measured with other settings, and note its settings."""
    settings = repr((one.paths, one.choice, one.quick))
    if found.setdefault("settings", {}).get(one.name, settings) != settings:
        for key in [key for key in found["parts"] if key.split("|")[0] == one.name]:
            del found["parts"][key]
    found["settings"][one.name] = settings


def parts(one: RecordingSet) -> dict[str, Callable[[], Any]]:
    """Return the measurements of a set, by name; each returns plain data, in nats."""
    found: dict[str, Callable[[], Any]] = {
        "histogram": partial(section_6, one),
        "neighbours": partial(neighbours, one),
        "classifier": partial(classifier, one),
        "places": partial(places, one),
    }
    if not one.paths:
        for size in range(2, len(vocabulary.order()) + 1):
            found[f"vocabulary {size}"] = partial(vocabulary.measure, one.preset, size, SEED + 1)
    return found


def section_6(one: RecordingSet) -> dict[str, Any]:
    """Return section 6 as printed, and its corrections: means over the seeds, and by seed."""
    sessions = one.as_the_paper()
    rows = [_corrections(z, y) for z, y in sessions]
    return {
        "mean": {name: float(np.mean([row[name] for row in rows])) for name in rows[0]},
        "seeds": rows,
        "bins": [_binned(*sessions[0], bins) for bins in BINS],
    }


def _corrections(z: NDArray[np.float64], y: NDArray[np.int64]) -> dict[str, float]:
    """Return the means over the sensors for z (frames, sensors) and labels (frames,), nats."""
    own = histogram.statistics(z, y)
    cut_off = histogram.statistics(histogram.clipped(z, y), y)
    whole = histogram.statistics(z, y, scaling="global")
    sound = histogram.statistics(z, y, scaling="global", corrected=True)
    found = {"frames": len(y), "p_static": float((y == 0).mean()),
             "h_uniform": float(np.log(len(np.unique(y)))), "h_y": float(own.h_y[0])}  # fmt: skip
    for suffix, one in (
        ("", own),
        ("_clipped", cut_off),
        ("_global", whole),
        ("_corrected", sound),
    ):
        found[f"h_z{suffix}"] = float(one.h_z.mean())
        found[f"information{suffix}"] = float(one.information.mean())
    return found | {
        "least": float(sound.information.min()),
        "most": float(sound.information.max()),
        "null": histogram.null_information(z, y),
        "null_slow": histogram.null_information(z, y, slow=True),
    }


def _binned(z: NDArray[np.float64], y: NDArray[np.int64], bins: int) -> dict[str, float]:
    """Return the means over the sensors with so many bins, for z (frames, sensors), nats."""
    whole = histogram.statistics(z, y, bins, "global")
    sound = histogram.statistics(z, y, bins, "global", corrected=True)
    return {
        "bins": bins,
        "h_z": float(whole.h_z.mean()),
        "information": float(whole.information.mean()),
        "corrected": float(sound.information.mean()),
        "null": histogram.null_information(z, y, bins, shuffles=2),
    }


def neighbours(one: RecordingSet) -> dict[str, Any]:
    """Return Ross's estimate on single images and on principal components of windows.

    "leaky": any neighbours; "apart": none of the same touch or close in time; "days": of other
    days only.
    """
    windows = cut(one.recordings(), choice=one.choice)
    windows = windows.every(max(1, -(-len(windows.y) // POINTS)))
    event, frame, session = windows.event, windows.frame, windows.session
    exclusions: dict[str, knn.Exclusion | None] = {
        "leaky": None,
        "apart": knn.Exclusion(event, frame, session, round(THEILER_S * windows.rate_hz)),
    }
    if len(np.unique(session)) > 1:
        exclusions["days"] = knn.Exclusion(session, frame, session)
    image = windows.x[:, -1].astype(np.float64)
    points = {
        "image": image,
        "image, whitened": knn.whitened(image),
        **{f"{n} components": knn.principal(windows.flat, n) for n in COMPONENTS},
    }
    rows = {
        name: {"dimensions": x.shape[1]} | {
            kind: _figure(bootstrap.event_mean(knn.ross(x, windows.y, exclusion=exclusion), event))
            for kind, exclusion in exclusions.items()
        }
        for name, x in points.items()
    }  # fmt: skip
    h_y = histogram.entropy(windows.y)
    return {"points": len(windows.y), "theiler_s": THEILER_S, "h_y": h_y, "rows": rows}


def classifier(one: RecordingSet) -> dict[str, Any]:
    """Return held-out bounds for windows and whole gestures, by several classifiers."""
    recordings = one.recordings()
    rows: dict[str, Any] = {}
    rests: tuple[Rest, ...] = ("first", "followed")
    kinds: tuple[classifier_bound.Kind, ...] = ("linear", "mlp")
    for rest in rests:
        windows = cut(recordings, choice=one.choice, rest=rest).every(STEP)
        for kind in kinds:
            # One layer does not learn symmetries.
            varied = (rest, kind) == ("followed", "mlp")
            variation = classifier_bound.Variation.of(windows) if varied else None
            answers = classifier_bound.held_out(windows, kind, epochs=EPOCHS, variation=variation)
            rows[f"{kind}, rest {rest}"] = _bounds(windows, answers)
    if (shipped := _shipped(windows)) is not None:
        rows["the bundle that ships"] = _bounds(windows, shipped)
    y, _ = classifier_bound.gestures(windows, answers.scaled)
    return {
        "windows": len(windows.y),
        "days": len(np.unique(windows.session)),
        "h_y": histogram.entropy(windows.y),
        "gestures": len(y),
        "h_gesture": histogram.entropy(y),
        "rows": rows,
    }


def _bounds(windows: Windows, answers: classifier_bound.HeldOut) -> dict[str, list[float]]:
    return {
        "raw": _figure(classifier_bound.window_bound(windows, answers.raw)),
        "scaled": _figure(classifier_bound.window_bound(windows, answers.scaled)),
        "gesture": _figure(classifier_bound.gesture_bound(windows, answers)),
    }


def _shipped(windows: Windows) -> classifier_bound.HeldOut | None:
    """Return the shipped bundle's answers, temperatures from the other days; None: no fit."""
    loaded = bundle.read(bundle.default_path())
    fits = (
        loaded.labels == windows.labels
        and (loaded.rows, loaded.columns) == windows.grid
        and loaded.preprocess.window == windows.x.shape[1]
        and loaded.rate_hz == windows.rate_hz
    )
    if not fits:
        return None
    z = 1.0 + windows.x.reshape(len(windows.x), -1, *windows.grid) / GAIN
    return classifier_bound.rescaled(windows, Batched(loaded).probabilities(z.astype(np.float32)))


def places(one: RecordingSet) -> dict[str, Any] | None:
    """Return the information of presses' images about their places; None: unknown places.

    One point for each press: the principal components of its mean image, and its true place.
    """
    recordings = one.recordings() if one.paths else one.recordings(gestures=("press",))
    windows = cut(recordings, choice=one.choice)
    windows = windows.pick(np.asarray(np.isfinite(windows.place).all(axis=1)))
    number = np.unique(windows.event, return_inverse=True)[1]
    count = np.bincount(number)[:, None].astype(np.float64)
    if len(count) < LEAST:
        return None
    images, where = np.zeros((len(count), windows.x.shape[2])), np.zeros((len(count), 2))
    np.add.at(images, number, windows.x[:, -1])
    np.add.at(where, number, windows.place)
    rows = {}
    for components in PLACE_COMPONENTS:
        part, missed = knn.ksg_corrected(knn.principal(images / count, components), where / count)
        plain = _figure(bootstrap.event_mean(part, np.arange(len(part))))
        rows[f"{components} components"] = {
            "dimensions": components, "plain": plain, "missed": missed
        }  # fmt: skip
    return {"presses": len(count), "rows": rows}


def _figure(found: Figure) -> list[float]:
    return [found.value, found.low, found.high]
