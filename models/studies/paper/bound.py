"""Lower bound on I(window; label) from the cross-entropy of a bundle's answers on its labels.

For any q(y | window), I >= H(y) - E[-log q(y | window)], if q was trained on other labels.
Probabilities are scaled by a temperature that is chosen on the other sessions (D. Barber,
F. Agakov, The IM algorithm, NIPS 2003, for the bound; C. Guo et al., On calibration of modern
neural networks, ICML 2017, for the temperature).
"""

from collections.abc import Iterable
from dataclasses import astuple, dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles.bundle import Bundle
from controller.recordings.recording import UNKNOWN, Recording
from models.data.examples import run_starts
from models.data.ground_truth import GroundTruth
from models.evaluation import bootstrap, scores
from models.evaluation.replay import Batched, network_inputs, refuse
from models.studies.paper.section6 import entropy

STEP: Final = 2  # from one window to the next
SILENCE: Final = 3  # frames without a class, beyond which one event ends
FEWEST: Final = 40  # gestures from which their temperature is chosen
LEAST: Final = 1e-12  # probability

Numbers = NDArray[np.int64]  # (n,)
Logits = NDArray[np.float64]  # (n, classes): logarithms of probabilities


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
        p /= np.maximum(p.sum(axis=1, keepdims=True), LEAST)
        return self.y[use][first] - 1, self.session[use][first], _log(p)


def answers(bundle: Bundle, recordings: Iterable[Recording]) -> Answers:
    """Return a bundle's answers to recordings of its sensor; ValueError for any other."""
    networks, parts = Batched(bundle), []
    for number, recording in enumerate(recordings):
        refuse(recording, bundle)
        truth = GroundTruth.of(recording, bundle.labels, f"recording {number + 1}")
        inputs = network_inputs(recording.frames, bundle.preprocess)
        known = (truth.label != UNKNOWN) & ~truth.excluded
        use = known[inputs.last]
        log_p = _log(networks.probabilities(inputs.windows[use]).astype(np.float64))
        frame = inputs.last[use]
        parts.append((log_p, truth.label[frame], np.full(len(frame), number), frame))
    log_p, y, session, frame = (np.concatenate(column) for column in zip(*parts, strict=True))
    # A single frame of unknown class separates nothing; a longer silence does.
    event = np.cumsum(run_starts(frame, y, session, gap=SILENCE)) - 1
    return Answers(log_p[::STEP], y[::STEP], session[::STEP], event[::STEP])


def measure(found: Answers) -> dict[str, Any]:
    """Return entropies of windows and gestures, and the bounds on both, [value, low, high], nats.

    The answers to each session are calibrated on the others, windows and gestures apart.
    """
    log_p = _calibrated(found.log_p, found.y, found.session)
    label, session, whole = found.gestures(found.log_p)
    whole = _calibrated(whole, label, session, FEWEST)
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
    """Return logarithms of probabilities (n, classes), of which none is taken below `LEAST`."""
    return np.asarray(np.log(np.maximum(p, LEAST)))
