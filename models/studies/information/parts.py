"""The parts of the study, each a function of a set that returns plain data; nats everywhere."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles import bundle
from models.evaluation import bootstrap
from models.evaluation.replay import Batched
from models.results.figure import Figure
from models.studies.information import (
    classifier_bound,
    histogram,
    infonce,
    knn,
    scaling,
    vocabulary,
)
from models.studies.information.sets import DAYS, RecordingSet
from models.studies.information.windows import GAIN, Taken, take

Part = Callable[[], Any]

BINS: Final = (5, 10, 25, 50, 100, 250, 1000)
COMPONENTS: Final = (1, 2, 3, 5, 8, 12, 20)
THEILER_S: Final = 2.0  # so close in time nothing is a neighbour, and nothing of the same touch
POINTS: Final = 5000  # at most, for neighbours
STEP: Final = 2  # every so manieth window
EPOCHS: Final = 30
LEAST: Final = 100  # presses; of fewer nothing is said about places


def parts(one: RecordingSet) -> dict[str, Part]:
    """Return what can be measured of a set, by name."""
    found: dict[str, Part] = {
        "histogram": partial(paper, one),
        "neighbours": partial(near, one),
        "classifier": partial(classifier, one),
        "contrast": partial(told_apart, one),
    }
    for kind in scaling.KINDS:
        found[f"growth {kind}"] = partial(grows, one, kind)
    found["places"] = partial(places, one)
    if not one.paths:
        for size in range(2, len(vocabulary.order()) + 1):
            found[f"vocabulary {size}"] = partial(
                vocabulary.worth, one.preset, size, one.data().seed + 1
            )
    return found


def paper(one: RecordingSet) -> dict[str, Any]:
    """Section 6 as printed, and what is wrong with it: means over the seeds, and by seed."""
    rows, against = [], []
    for z, y in one.as_the_paper():
        own = histogram.histogram_statistics(z, y)
        whole = histogram.histogram_statistics(z, y, scaling="global")
        sound = histogram.corrected_statistics(z, y)
        cut = histogram.histogram_statistics(histogram.clipped(z, y), y)
        classes = len(np.unique(y))
        rows.append(
            {
                "frames": len(y),
                "p_static": float((y == 0).mean()),
                "h_uniform": float(np.log(classes)),
                "h_y": own.h_y,
                "h_z": float(own.h_z.mean()),
                "information": float(own.information.mean()),
                "h_z_clipped": float(cut.h_z.mean()),
                "information_clipped": float(cut.information.mean()),
                "h_z_global": float(whole.h_z.mean()),
                "information_global": float(whole.information.mean()),
                "h_z_corrected": float(sound.h_z.mean()),
                "information_corrected": float(sound.information.mean()),
                "least": float(sound.information.min()),
                "most": float(sound.information.max()),
                "null": histogram.null_information(z, y),
                "null_slow": histogram.null_information(z, y, slow=True),
            }
        )
        if len(rows) == 1:
            against = [_binned(z, y, bins) for bins in BINS]
            sensors = [[float(v) for v in s] for s in (own.h_z, own.information, sound.information)]
    mean = {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}
    return {"mean": mean, "seeds": rows, "bins": against, "sensors": sensors}


def _binned(z: NDArray[np.float64], y: NDArray[np.int64], bins: int) -> dict[str, float]:
    whole = histogram.histogram_statistics(z, y, bins, "global")
    sound = histogram.corrected_statistics(z, y, bins)
    own = histogram.histogram_statistics(z, y, bins)
    return {
        "bins": bins,
        "h_z": float(whole.h_z.mean()),
        "paper": float(own.information.mean()),
        "information": float(whole.information.mean()),
        "corrected": float(sound.information.mean()),
        "null": histogram.null_information(z, y, bins, shuffles=2),
    }


def near(one: RecordingSet) -> dict[str, Any]:
    """Ross's estimate on single images and on principal components of windows."""
    taken = _some(take(one.recordings(), choice=one.choice), POINTS)
    window = round(THEILER_S * taken.rate_hz)
    close = knn.Apart(taken.event, taken.frame, taken.session, window)
    days = knn.Apart(taken.session, taken.frame, taken.session)
    flat = taken.x.reshape(len(taken.x), -1)
    frame = taken.x[:, -1]
    points: dict[str, NDArray[np.float64]] = {
        "image": np.asarray(frame, dtype=np.float64),
        "image, whitened": knn.whitened(frame),
        **{f"{n} components": knn.principal(flat, n) for n in COMPONENTS},
    }
    several = len(np.unique(taken.session)) > 1
    rows = {}
    for name, x in points.items():
        leaky = knn.ross(x, taken.y)
        apart = knn.ross(x, taken.y, apart=close)
        rows[name] = {
            "dimensions": x.shape[1],
            "leaky": _figure(bootstrap.event_mean(leaky, taken.event)),
            "apart": _figure(bootstrap.event_mean(apart, taken.event)),
        }
        if several:
            other = knn.ross(x, taken.y, apart=days)
            rows[name]["days"] = _figure(bootstrap.event_mean(other, taken.event))
    return {"points": len(taken.y), "theiler_s": THEILER_S, "h_y": _entropy(taken.y), "rows": rows}


def classifier(one: RecordingSet) -> dict[str, Any]:
    """Bounds by what was held out: windows and whole gestures, by several classifiers."""
    recordings = one.recordings()
    rows: dict[str, Any] = {}
    for rest in ("first", "followed"):
        taken = take(recordings, choice=one.choice, rest=rest).every(STEP)
        for kind in ("linear", "mlp"):
            varied = (rest, kind) == ("followed", "mlp")  # one layer learns no symmetry
            shape = classifier_bound.Shape.of(taken) if varied else None
            told = classifier_bound.told(taken, kind, epochs=EPOCHS, shape=shape)
            rows[f"{kind}, rest {rest}"] = _told(taken, told)
    if (given := _shipped(taken)) is not None:
        rows["the bundle that ships"] = _told(taken, given)
    y, _ = classifier_bound.of_gestures(taken, told.scaled)
    return {
        "windows": len(taken.y),
        "days": len(np.unique(taken.session)),
        "h_y": _entropy(taken.y),
        "gestures": len(y),
        "h_gesture": _entropy(y),
        "rows": rows,
    }


def _told(taken: Taken, told: classifier_bound.Told) -> dict[str, Any]:
    return {
        "raw": _figure(classifier_bound.windows(taken, told.raw)),
        "scaled": _figure(classifier_bound.windows(taken, told.scaled)),
        "gesture": _figure(classifier_bound.gestures(taken, told)),
    }


def _shipped(taken: Taken) -> classifier_bound.Told | None:
    """Return what the shipped bundle says, its temperature from the other days; None: no fit."""
    loaded = bundle.read(bundle.default_path())
    fits = (
        loaded.labels == taken.labels
        and (loaded.rows, loaded.columns) == taken.grid
        and loaded.preprocess.window == taken.x.shape[1]
        and loaded.rate_hz == taken.rate_hz
    )
    if not fits:
        return None
    z = 1.0 + taken.x.reshape(len(taken.x), -1, *taken.grid) / GAIN
    return classifier_bound.rescaled(taken, Batched(loaded).probabilities(z.astype(np.float32)))


def told_apart(one: RecordingSet) -> dict[str, Any]:
    """InfoNCE between windows and labels, on days that were held out."""
    taken = take(one.recordings(), choice=one.choice).every(STEP)
    part = infonce.info_nce(
        taken.x.reshape(len(taken.x), -1),
        infonce.one_hot(taken.y, len(taken.labels)),
        classifier_bound.folds(taken),
    )
    return {"windows": len(taken.y), "found": _figure(bootstrap.event_mean(part, taken.event))}


def grows(one: RecordingSet, kind: str) -> list[dict[str, Any]]:
    """The held-out bound while one thing grows: a row for each value."""
    recordings, choice = one.recordings(), one.choice
    origin = recordings[0].origin
    rate, side = origin.rate_hz, max(origin.rows, origin.columns)
    made: list[tuple[float, str, Callable[[], Taken]]] = []
    if kind == "taxels":
        whole = take(recordings, choice=choice)
        for count in range(1, side + 1):
            rows, columns = min(count, origin.rows), min(count, origin.columns)
            one_side = partial(scaling.taxels, whole, count)
            made.append((rows * columns, f"{rows}×{columns}", one_side))
        for count in () if one.paths else scaling.DENSER:
            denser = replace(one.data(), rows=count, columns=count)
            made.append((count * count, f"{count}×{count}", partial(_simulated, denser)))
    elif kind == "window":
        for seconds in scaling.WINDOWS_S:
            if seconds * rate >= 1:
                longer = partial(scaling.windows, recordings, seconds, choice)
                made.append((seconds, f"{seconds:g} s", longer))
    elif kind == "rate":
        for step in scaling.SLOWER:
            some = [scaling.slower(recording, step) for recording in recordings]
            made.append((rate / step, f"{rate / step:g} Hz", partial(take, some, choice=choice)))
        for times in () if one.paths else scaling.FASTER:
            faster = replace(one.data(), rate_hz=times * rate)
            made.append((times * rate, f"{times * rate:g} Hz", partial(_simulated, faster)))
    else:
        for bits in scaling.BITS:
            some = [scaling.coarser(recording, bits) for recording in recordings]
            made.append((bits, f"{bits} bits", partial(take, some, choice=choice)))
    table: list[dict[str, Any]] = []
    for value, name, of in made:
        try:
            worth = scaling.worth(of())
        except ValueError:  # such a sensor never finds its rest: it says nothing
            worth = {what: [np.nan] * 3 for what in ("window", "gesture")}
        table.append({"value": value, "name": name, **worth})
    return table


def _simulated(data: Any) -> Taken:
    """Return windows of other simulated sessions of as many days."""
    return take([data.session(0, day) for day in range(DAYS)])


def places(one: RecordingSet) -> dict[str, Any] | None:
    """What images of presses tell about where they are; None: nobody knows where they were.

    One point for each press: the principal components of its mean image, and where it truly was.
    """
    if one.paths:
        recordings = one.recordings()
    else:
        data = replace(one.data(), gestures=("press",))
        recordings = [data.session(0, day) for day in range(DAYS)]
    taken = take(recordings, choice=one.choice)
    taken = taken.pick(np.asarray(np.isfinite(taken.place).all(axis=1)))
    first, number = np.unique(taken.event, return_index=True, return_inverse=True)[1:]
    if len(first) < LEAST:
        return None
    count = np.bincount(number)[:, None].astype(np.float64)
    images, where = np.zeros((len(first), taken.x.shape[2])), np.zeros((len(first), 2))
    np.add.at(images, number, taken.x[:, -1])
    np.add.at(where, number, taken.place)
    return located(images / count, where / count, taken.session[first])


def located(
    images: NDArray[np.float64], where: NDArray[np.float64], day: NDArray[np.int64]
) -> dict[str, Any]:
    """Return the information of images about places: Kraskov's estimate, and InfoNCE."""
    number = np.arange(len(images))
    rows = {}
    for count in (2, 4, 6):
        part, missed = knn.ksg_corrected(knn.principal(images, count), where)
        found = bootstrap.event_mean(part, number)
        rows[f"{count} components"] = {
            "dimensions": count, "plain": _figure(found), "missed": missed,
        }  # fmt: skip
    one_each = Taken(
        images[:, None].astype(np.float32), np.zeros(len(images), int), day, number, number,
        where.astype(np.float32), ("press",), 1.0, (1, images.shape[1]),
    )  # fmt: skip
    part = infonce.info_nce(images, where, classifier_bound.folds(one_each), epochs=60)
    return {
        "presses": len(images),
        "rows": rows,
        "contrast": _figure(bootstrap.event_mean(part, number)),
    }


def _some(taken: Taken, most: int) -> Taken:
    """Return windows evenly spread in time, not more than so many."""
    return taken.every(max(1, -(-len(taken.y) // most)))


def _entropy(y: NDArray[np.int64]) -> float:
    return histogram.entropy(np.bincount(y) / max(1, len(y)))


def _figure(found: Figure) -> list[float]:
    return [found.value, found.low, found.high]
