"""Information by vocabulary size: two gestures, three, ... all that the hand can do.

For each vocabulary its owner plays it, alone, on some days; a classifier learns it (heldout.py),
the device's debouncer answers, its threshold chosen on one more day; and other days say which
gesture came out as which, and how long each takes. That is a channel (channel.py).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from controller.bundles.vocabulary import Entry, Vocabulary
from controller.recognition.debounce import DebounceSettings
from controller.recognition.preprocess import PreprocessSettings
from controller.simulator.gesture_file import shipped
from controller.simulator.hand import GESTURES
from models.data.augment import Symmetry
from models.data.ground_truth import know
from models.data.simulate import DataSet
from models.evaluation import scores
from models.evaluation.event_counts import attach
from models.evaluation.replay import Stream, answered, feel
from models.studies.information import channel, classifier_bound
from models.studies.information.windows import GAIN, take

TAUGHT: Final = 3  # days to learn from, and one more that chooses
JUDGED: Final = 3  # other days
OWNERS: Final = 2
MINUTES: Final = 6.0  # of each
STEP: Final = 3
EPOCHS: Final = 24
ON: Final = (0.5, 0.6, 0.7, 0.8, 0.9)
PAUSE_S: Final = 0.67  # from one gesture's last touch to the next: the demo's median (games.py)


def order() -> tuple[str, ...]:
    """Return all gestures, in the order in which a vocabulary grows: the paper's four first."""
    known = shipped()
    others = sorted(name for name, one in known.items() if not one.distractor)
    return (*GESTURES, *(name for name in others if name not in GESTURES))


def worth(preset: str, size: int, seed: int) -> dict[str, Any]:
    """Return what a vocabulary of so many gestures is worth: plain data, nats and seconds.

    Args:
        preset: Quality of the orb.
        size: How many gestures.
        seed: Of the owners and the days.

    Returns:
        `labels`; `counts` (rows: made; columns: came out as; the last: nothing), `right`, `seconds`
        of each gesture, `capacity`, `fastest`, `fastest_s`, `fastest_per_min`, `alarms_per_min`,
        `late_s`: all owners together.
    """
    labels = order()[:size]
    data = DataSet(seed=seed, minutes=MINUTES, preset=preset, gestures=labels)
    streams = [one for owner in range(OWNERS) for one in _played(data, owner, labels)]
    return {"labels": list(labels), **_figures(_counted(streams, labels), labels)}


def _played(data: DataSet, owner: int, labels: tuple[str, ...]) -> list[Stream]:
    """Return what an orb that its owner has taught answers on other days."""
    days = [data.session(owner, day) for day in range(TAUGHT + 1 + JUDGED)]
    taken = take(days[: TAUGHT + 1]).every(STEP)
    learned = taken.session < TAUGHT
    flat = taken.x.reshape(len(taken.x), -1)
    check = flat[~learned], taken.y[~learned]
    ask = classifier_bound.fitted(
        (flat[learned], taken.y[learned]), check, 1 + len(labels), "mlp", owner, EPOCHS,
        classifier_bound.Shape(taken.grid, _symmetry(labels, taken.grid)),
    )  # fmt: skip
    hot = scores.temperature(ask(check[0]), check[1])
    settings = PreprocessSettings(rate_hz=taken.rate_hz, window=taken.x.shape[1])
    named = ("null", *labels)

    def stream(day: int, on: float) -> Stream:
        recording = days[day]
        felt = feel(recording.frames, settings)
        asked = GAIN * (felt.windows.reshape(len(felt.windows), -1) - 1.0)
        given = scores.softmax(ask(asked.astype(np.float32)), hot).astype(np.float32)
        known = know(recording, named, str(day))
        return answered(known, felt, given, named, replace(DebounceSettings(), on=on))

    def right(on: float) -> float:
        one = _counted([stream(TAUGHT, on)], labels)
        # A false alarm costs as much as a gesture that is lost.
        return float(np.trace(one["counts"]) - one["alarms"])

    on = max(ON, key=right)
    return [stream(TAUGHT + 1 + day, on) for day in range(JUDGED)]


def _counted(streams: Sequence[Stream], labels: Sequence[str]) -> dict[str, Any]:
    """Return what came out of all gestures, how long they took, and what nobody made."""
    counts = np.zeros((len(labels), len(labels) + 1), dtype=np.int64)
    lasts: list[list[float]] = [[] for _ in labels]
    late: list[float] = []
    alarms, minutes = 0, 0.0
    for one in streams:
        events = one.known.events
        first: dict[int, int] = {}
        for answer, owner in zip(one.answers, attach(events, one.answers), strict=True):
            if owner < 0:
                alarms += 1
            elif owner not in first:
                first[owner] = labels.index(answer.kind)
                late.append(answer.time_s - events[owner].onset_s)
        for number, event in enumerate(events):
            made = labels.index(event.kind)
            counts[made, first.get(number, len(labels))] += 1
            lasts[made].append(event.release_s - event.onset_s)
        minutes += float(one.known.t[-1] - one.known.t[0]) / 60.0
    seconds = [float(np.mean(one)) + PAUSE_S if one else PAUSE_S for one in lasts]
    return {
        "counts": counts, "seconds": seconds, "alarms": alarms, "minutes": minutes,
        "late_s": float(np.median(late)) if late else float("nan"),
    }  # fmt: skip


def _figures(found: dict[str, Any], labels: Sequence[str]) -> dict[str, Any]:
    counts = found["counts"]
    best = channel.best_use(channel.rows(counts))
    fastest = channel.fastest_use(channel.rows(counts), found["seconds"])
    return {
        "counts": counts.tolist(),
        "right": float(np.trace(counts[:, : len(labels)]) / counts.sum()),
        "seconds": [round(one, 4) for one in found["seconds"]],
        "capacity": best.nats,
        "fastest": fastest.nats,
        "fastest_s": fastest.seconds,
        "fastest_per_min": fastest.nats_per_min,
        "alarms_per_min": found["alarms"] / found["minutes"],
        "late_s": found["late_s"],
    }


def _symmetry(labels: Sequence[str], grid: tuple[int, int]) -> Symmetry:
    """Return what the simulated hand's gestures declare of themselves."""
    known = shipped()
    declared = tuple(
        Entry(name, name, known[name].rotations, mirror if mirror in own else "none")
        for name in labels
        for own, mirror in [(("self", "none", *labels), known[name].mirror)]
    )
    return Symmetry.of(Vocabulary("the hand's", declared), *grid)
