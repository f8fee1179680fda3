"""Data sets of an information study, and the measurement of their parts, in nats."""

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
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
from models.studies.information import classifier_bound, histogram, knn, vocabulary
from models.studies.information.histogram import PAPER_FRAMES
from models.studies.information.tables import Results, keep, load
from models.studies.information.windows import GAIN, Windows, as_the_paper, cut, fixed_ratio

SEED: Final = TEST_SEEDS.start + 20  # no training accepts it
DAYS: Final = 4  # of one person
MINUTES: Final = 6.0  # of each
PAPER_MINUTES: Final = 29.2  # two such sessions hold the paper's frames
PAPER_SEEDS: Final = 5  # people and orbs
COMPONENTS: Final = (3, 8, 20)
PLACE_COMPONENTS: Final = 4
THEILER_S: Final = 2.0  # so close in time nothing is a neighbour, and nothing of the same touch
POINTS: Final = 5000  # at most, for neighbours
STEP: Final = 2  # from one window to the next
EPOCHS: Final = 30
LEAST: Final = 100  # presses: fewer give no information about places

Session = tuple[NDArray[np.float64], NDArray[np.int64]]  # z (frames, taxels), labels (frames,)


@dataclass(frozen=True, slots=True)
class RecordingSet:
    """Sessions that belong together."""

    name: str  # title of the set
    paths: tuple[Path, ...] = ()  # files; none: people are simulated
    preset: str = ""  # quality of the simulated orbs
    choice: Choice = "auto"  # source of the labels
    quick: bool = False  # a third of the simulated minutes, and one seed

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
        signals.append(fixed_ratio(session.frames, 10.0))
        labels.append(session.button.astype(np.int64))
    return np.concatenate(signals)[:PAPER_FRAMES], np.concatenate(labels)[:PAPER_FRAMES]


def measure(
    sets: Sequence[RecordingSet],
    only: Sequence[str],
    workers: int,
    path: Path | None,
    say: Callable[[str], None],
) -> Results:
    """Return all results, measuring what the file, written after each part, does not hold.

    `only` has first words of names of parts, or "none"; if it is empty, all are measured.
    """
    found, jobs = load(path), {}
    for one in sets:
        settings = f"{one.paths} {one.choice} {one.quick}"
        if found["settings"].get(one.name) != settings:  # measured otherwise
            stale = [key for key in found["parts"] if key.split("|")[0] == one.name]
            for key in stale:
                del found["parts"][key]
        found["settings"][one.name] = settings
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


def section_6(one: RecordingSet) -> dict[str, float]:
    """Return section 6 as printed, and its corrections: means over the seeds."""
    rows = [_corrections(z, y) for z, y in one.as_the_paper()]
    return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}


def _corrections(z: NDArray[np.float64], y: NDArray[np.int64]) -> dict[str, float]:
    """Return the means over the sensors for z (frames, sensors) and labels (frames,), nats."""
    own, whole = histogram.statistics(z, y), histogram.statistics(z, y, "global")
    sound = histogram.statistics(z, y, "global", corrected=True).information
    return {
        "p_static": float((y == 0).mean()),
        "h_uniform": float(np.log(len(np.unique(y)))),
        "h_y": float(own.h_y[0]),
        "h_z": float(own.h_z.mean()),
        "information": float(own.information.mean()),
        "information_global": float(whole.information.mean()),
        "information_corrected": float(sound.mean()),
        "least": float(sound.min()),
        "most": float(sound.max()),
        "null": histogram.null_information(z, y),
        "null_slow": histogram.null_information(z, y, slow=True),
    }


def neighbours(one: RecordingSet) -> dict[str, Any]:
    """Return Ross's estimate on images and on components of windows, of other touches and times."""
    windows = cut(one.recordings(), one.choice)
    windows = windows.every(max(1, -(-len(windows.y) // POINTS)))
    apart = round(THEILER_S * windows.rate_hz)
    exclusion = knn.Exclusion(windows.event, windows.frame, windows.session, apart)
    points: dict[str, NDArray[np.floating]] = {"image": windows.x[:, -1]}
    points |= {f"window, {n} components": knn.principal(windows.flat, n) for n in COMPONENTS}
    rows = {
        name: list(astuple(bootstrap.event_mean(knn.ross(x, windows.y, exclusion), windows.event)))
        for name, x in points.items()
    }
    return {"h_y": histogram.entropy(windows.y), "rows": rows}


def classifier(one: RecordingSet) -> dict[str, Any]:
    """Return held-out bounds for windows and whole gestures, by several classifiers."""
    windows = cut(one.recordings(), one.choice).every(STEP)
    variation = classifier_bound.Variation.of(windows)  # one layer does not learn symmetries
    answers = {
        "linear": classifier_bound.held_out(windows, "linear", epochs=EPOCHS),
        "two layers": classifier_bound.held_out(windows, epochs=EPOCHS, variation=variation),
    }
    if (own := shipped(windows)) is not None:
        answers[f"the bundle that ships for {windows.rate_hz:g} Hz (other people)"] = own
    y, _ = classifier_bound.gestures(windows, answers["linear"].log_p)
    return {
        "h_y": histogram.entropy(windows.y),
        "gestures": len(y),
        "h_gesture": histogram.entropy(y),
        "rows": {
            name: {
                "window": list(astuple(classifier_bound.window_bound(windows, own.log_p))),
                "gesture": list(astuple(classifier_bound.gesture_bound(windows, own))),
            }
            for name, own in answers.items()
        },
    }


def places(one: RecordingSet) -> dict[str, Any] | None:
    """Return the information of presses' mean images about their places; None: too few are known.

    Each press is one point: its image's principal components, and its true place.
    """
    windows = cut(one.recordings(**({} if one.paths else {"gestures": ("press",)})), one.choice)
    windows = windows.pick(np.asarray(np.isfinite(windows.place).all(axis=1)))
    presses = [windows.event == number for number in np.unique(windows.event)]
    if len(presses) < LEAST:
        return None
    images, where = (
        np.array([column[press].mean(axis=0) for press in presses])
        for column in (windows.x[:, -1], windows.place)
    )
    x = knn.principal(images, PLACE_COMPONENTS)
    own = bootstrap.event_mean(knn.ksg(x / x.std(axis=0), where), np.arange(len(x)))
    return {"presses": len(presses), "information": list(astuple(own))}


def shipped(windows: Windows) -> classifier_bound.HeldOut | None:
    """Return the shipped bundle's answers, temperatures from the other days; None: no fit."""
    loaded = bundle.read(bundle.default_path(windows.rate_hz))
    theirs = loaded.labels, (loaded.rows, loaded.columns), loaded.window, loaded.rate_hz
    if theirs != (windows.labels, windows.grid, windows.x.shape[1], windows.rate_hz):
        return None
    z = 1.0 + windows.x.reshape(len(windows.x), -1, *windows.grid) / GAIN
    return classifier_bound.rescaled(windows, Batched(loaded).probabilities(z.astype(np.float32)))
