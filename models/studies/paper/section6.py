"""Section 6 of the paper: entropy and information by histograms, figure 9, and a lower bound.

The paper scales every sensor to [0, 1] for each gesture on its own, puts scaled values and labels
into 25-bin histograms, and prints H(y), H(z) and I(z, y) as "bits"; the figures are nats (R's
`entropy` package counts in nats by default). Scaling each gesture on its own leaks the label into
z; `scaling="global"` does not.

The lower bound on I(window; label) is from the cross-entropy of a bundle's answers on its labels:
for any q(y | window), I >= H(y) - E[-log q(y | window)], if q was trained on other labels.
Probabilities are scaled by a temperature that is chosen on the other sessions (D. Barber,
F. Agakov, The IM algorithm, NIPS 2003, for the bound; C. Guo et al., On calibration of modern
neural networks, ICML 2017, for the temperature).
"""

from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import entr  # the [train] extra

from controller.bundles.bundle import Bundle
from controller.recordings.recording import UNKNOWN, Recording
from controller.simulator.orb import PRESETS
from controller.simulator.session import TEST_SEEDS, simulate
from models.data.examples import PEOPLE_SOURCES, column, labellers, renumbered, run_starts
from models.data.ground_truth import GroundTruth
from models.evaluation import bootstrap, scores
from models.evaluation.replay import network_inputs, probabilities, refuse

BINS: Final = 25  # paper, section 6
PAPER_FRAMES: Final = 34_795
PAPER_MINUTES: Final = 29.2  # two such sessions hold the paper's frames
PAPER_RATE_HZ: Final = 10.0
PAPER_H_Y: Final = 1.28  # nats
PAPER_H_Z: Final = 2.71  # nats, mean over the sensors: paper, section 6
PAPER_INFORMATION: Final = 0.13  # nats
PAPER_STATIC: Final = 0.57  # share of frames without a gesture
REST_S: Final = 10.0  # paper, section 4.1: C0 is the mean of the first ten seconds
SEEDS: Final = 5  # simulated people and orbs
BITS: Final = 1.0 / np.log(2.0)  # bits in a nat
SHUFFLES: Final = 5
_STEP: Final = 2  # from one window of the bound to the next
_SILENCE: Final = 3  # frames without a class, beyond which one event ends
_FEWEST: Final = 40  # gestures from which their temperature is chosen
_LEAST: Final = 1e-12  # probability

Scaling = Literal["paper", "global"]
Signals = NDArray[np.floating]  # (frames, sensors), C / C0
Classes = NDArray[np.integer]  # (frames,), from 0
Session = tuple[NDArray[np.float64], NDArray[np.int64]]  # signals, classes
Numbers = NDArray[np.int64]  # (n,)
Logits = NDArray[np.float64]  # (n, classes): logarithms of probabilities


@dataclass(frozen=True, slots=True)
class Statistics:
    """Entropies and information of several sensors in nats, (sensors,) each."""

    h_z: NDArray[np.float64]  # entropy of each sensor's quantised signal
    h_y: NDArray[np.float64]  # entropy of the labels, the same for each
    information: NDArray[np.float64]  # mutual information of each sensor with the labels


def simulated(preset: str) -> list[Session]:
    """Return the paper's frames and the button's labels of one person's two sessions, by seed."""
    found = []
    for seed in range(SEEDS):
        signals, labels = [], []
        for run in range(2):
            session = simulate(
                TEST_SEEDS.start + 10 * seed + run,
                PAPER_MINUTES,
                user=seed,
                model=PRESETS[preset],
                protocol="blocks",
            )
            signals.append(fixed_ratio(session.frames, PAPER_RATE_HZ))
            labels.append(session.button.astype(np.int64))
        both = np.concatenate(signals), np.concatenate(labels)
        found.append((both[0][:PAPER_FRAMES], both[1][:PAPER_FRAMES]))
    return found


def recorded(recordings: Sequence[Recording]) -> Session:
    """Return z and labels, as people gave them, of all frames; ValueError for several sensors.

    Labels are the button's, else the keys', else the cues', else the truth.
    """
    names = max((one.origin.labels for one in recordings), key=len)
    grids = {f"{one.origin.rows}×{one.origin.columns} taxels" for one in recordings}
    if len(grids) > 1:
        raise ValueError(f"recordings of {' and of '.join(sorted(grids))}; estimate from one kind")
    signals, labels = [], []
    for one in recordings:
        given = column(one, next(iter(labellers(one, PEOPLE_SOURCES)), "true"))
        label = renumbered(given, one.origin.labels, names).astype(np.int64)
        known = (label != UNKNOWN) & ~one.excluded
        signals.append(fixed_ratio(one.frames, one.origin.rate_hz)[known])
        labels.append(label[known])
    return np.concatenate(signals), np.concatenate(labels)


def fixed_ratio(frames: NDArray[np.float32], rate_hz: float) -> NDArray[np.float64]:
    """Return z, (n, taxels), of frames (n, rows, columns) divided by their first ten seconds."""
    rest = frames[: max(1, round(REST_S * rate_hz))].mean(axis=0)
    return np.asarray((frames / rest).reshape(len(frames), -1), dtype=np.float64)


def measure(sessions: Sequence[Session]) -> dict[str, float]:
    """Return section 6 as printed, and its corrections: means over sessions and sensors, nats."""
    rows = [_corrections(z, y) for z, y in sessions]
    return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}


def _corrections(z: Signals, y: Classes) -> dict[str, float]:
    """Return the means over the sensors for z (frames, sensors) and labels (frames,), nats."""
    own, whole = statistics(z, y), statistics(z, y, "global")
    sound = statistics(z, y, "global", corrected=True).information
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
        "null": null_information(z, y),
        "null_slow": null_information(z, y, slow=True),
    }


def statistics(
    z: Signals, y: Classes, scaling: Scaling = "paper", *, corrected: bool = False, bins: int = BINS
) -> Statistics:
    """Return the statistics of section 6, of signals (frames, sensors) and labels (frames,).

    The scaling is min-max of each sensor and label ("paper"), or of each sensor ("global"). If
    corrected, the bias of each entropy is removed, (used cells - 1) / 2n. Source: Miller, Note on
    the bias of information estimates, 1955 ("Miller-Madow").
    """
    labels, index = np.unique(y, return_inverse=True)
    scaled = np.empty(z.shape)
    groups = [index == k for k in range(len(labels))] if scaling == "paper" else [index >= 0]
    for group in groups:
        low, high = z[group].min(axis=0), z[group].max(axis=0)
        scaled[group] = (z[group] - low) / np.maximum(high - low, 1e-12)
    cell = np.minimum((scaled * bins).astype(np.int64), bins - 1)
    sensors = z.shape[1]
    place = (np.arange(sensors) * bins + cell) * len(labels) + index[:, None]
    count = np.bincount(place.ravel(), minlength=sensors * bins * len(labels))
    joint = count.reshape(sensors, bins, len(labels)) / len(z)
    return mutual_information(joint, len(z) if corrected else 0)


def null_information(z: Signals, y: Classes, *, slow: bool = False) -> float:
    """Return the estimate where sensors are unrelated to the labels, nats, mean of the sensors.

    Labels are shuffled; if `slow`, shifted in time by random amounts instead, the end joined to the
    beginning: both stay as slow as they are, so drift may agree with long gestures by chance.
    """
    rng, quarter, found = np.random.default_rng(0), len(y) // 4, []
    for _ in range(SHUFFLES):
        by = int(rng.integers(quarter, max(len(y) - quarter, quarter + 1)))
        other = np.roll(y, by) if slow else rng.permutation(y)
        found.append(statistics(z, other, "global").information.mean())
    return float(np.mean(found))


def entropy(y: Classes) -> float:
    """Return the Shannon entropy of class numbers (n,) from their frequencies, nats."""
    return float(entr(np.bincount(y) / max(1, len(y))).sum())


def mutual_information(joint: NDArray[np.float64], samples: float = 0) -> Statistics:
    """Return the statistics of (sensors, bins, labels), the bias of so many samples removed."""
    several = joint.sum(axis=2), joint.sum(axis=1), joint.reshape(len(joint), -1)
    h_z, h_y, h_both = (
        entr(p).sum(axis=1) + (np.count_nonzero(p, axis=1) - 1.0) / (2.0 * (samples or np.inf))
        for p in several
    )
    return Statistics(h_z, h_y, h_z + h_y - h_both)


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """A bundle's answers to the windows of several sessions."""

    log_p: Logits  # logarithm of the probability of each class, (n, classes)
    y: Numbers  # class of each window, that of its last frame, (n,)
    session: Numbers  # session of each, (n,)
    event: Numbers  # number of the touch, or of the pause between touches, across sessions, (n,)

    def gestures(self, log_p: Logits) -> tuple[Numbers, Numbers, Logits]:
        """Return class, from 0, session and mean log-probabilities (gestures, classes) of touches.

        `log_p` is that of each window, (n, classes).
        """
        use = self.y > 0
        _, first, number = np.unique(self.event[use], return_index=True, return_inverse=True)
        p = np.zeros((len(first), log_p.shape[1] - 1))
        np.add.at(p, number, np.exp(log_p[use, 1:]))
        p /= np.maximum(p.sum(axis=1, keepdims=True), _LEAST)
        return self.y[use][first] - 1, self.session[use][first], _log(p)


def answers(bundle: Bundle, recordings: Iterable[Recording]) -> Answers:
    """Return a bundle's answers to recordings of its sensor; ValueError for any other."""
    parts = []
    for number, recording in enumerate(recordings):
        refuse(recording, bundle)
        truth = GroundTruth.of(recording, bundle.labels, f"recording {number + 1}")
        inputs = network_inputs(recording.frames, bundle.preprocess)
        known = (truth.label != UNKNOWN) & ~truth.excluded
        use = known[inputs.last]
        log_p = _log(probabilities(bundle, inputs.windows[use]).astype(np.float64))
        frame = inputs.last[use]
        parts.append((log_p, truth.label[frame], np.full(len(frame), number), frame))
    log_p, y, session, frame = (np.concatenate(column) for column in zip(*parts, strict=True))
    # A single frame of unknown class separates nothing; a longer silence does.
    event = np.cumsum(run_starts(frame, y, session, gap=_SILENCE)) - 1
    return Answers(log_p[::_STEP], y[::_STEP], session[::_STEP], event[::_STEP])


def bounds(found: Answers) -> dict[str, Any]:
    """Return entropies of windows and gestures, and the bounds on both, [value, low, high], nats.

    The answers to each session are calibrated on the others, windows and gestures apart.
    """
    log_p = _calibrated(found.log_p, found.y, found.session)
    label, session, whole = found.gestures(found.log_p)
    whole = _calibrated(whole, label, session, _FEWEST)
    alone = np.arange(len(label))
    return {
        "h_y": entropy(found.y),
        "window": _bound(log_p, found.y, found.event),
        "gestures": len(label),
        "h_gesture": entropy(label),
        "gesture": _bound(whole, label, alone),
    }


def _bound(log_p: Logits, y: Numbers, event: Numbers) -> list[float]:
    """Return H(y) - cross-entropy with its interval over events, both (n,)."""
    return list(astuple(bootstrap.event_gain(log_p[np.arange(len(y)), y], y, event)))


def _calibrated(log_p: Logits, y: Numbers, session: Numbers, fewest: int = 1) -> Logits:
    """Return log-probabilities of classes (n,) scaled by the temperature of other sessions."""
    made = log_p.copy()
    for name in np.unique(session):
        own = session == name
        if (~own).sum() >= fewest:
            hot = scores.temperature(log_p[~own], y[~own])
            made[own] = _log(scores.softmax(log_p[own], hot))
    return made


def _log(p: NDArray[np.float64]) -> Logits:
    """Return logarithms of probabilities (n, classes), of which none is taken below `_LEAST`."""
    return np.asarray(np.log(np.maximum(p, _LEAST)))
