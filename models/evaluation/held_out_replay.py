"""Replay of the sessions held out of a training through its bundle, debouncing included.

A network may name every gesture rightly while the device misses some: it answers only where the
probability rises high enough, and soon enough.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np

from controller.bundles.bundle import Bundle
from controller.recordings import reader
from controller.recordings.recording import Recording
from models.data.examples import Choice
from models.data.ground_truth import GroundTruth
from models.data.load import Data
from models.data.splits import Split
from models.evaluation.event_counts import tally
from models.evaluation.replay import Batched, debounced_stream, network_inputs


def replay(loaded: Bundle, data: Data, split: Split) -> tuple[tuple[int, ...], ...]:
    """Return the gestures held out (rows; 0: nothing) by what is answered (columns; 0: nothing).

    Args:
        loaded: Bundle of the trained networks.
        data: Examples of the training.
        split: Its split. Recordings with gestures that the bundle does not answer
            are left out.
    """
    networks, labels = Batched(loaded), loaded.labels
    total = np.zeros((len(labels), len(labels)), dtype=np.int64)
    for number, recording in _held(data, split):
        row = data.rows[number]
        if any(count for label, count in row.examples.items() if label not in labels):
            continue
        truth = GroundTruth.of(recording, labels, row.path, cast(Choice, row.labeller))
        inputs = network_inputs(recording.frames, loaded.preprocess)
        outputs = networks.probabilities(inputs.windows)
        total += tally(
            debounced_stream(truth, inputs, outputs, labels, loaded.debounce), labels
        ).answered
    return tuple(tuple(counts) for counts in total.tolist())


def _held(data: Data, split: Split) -> Iterator[tuple[int, Recording]]:
    """Yield the number of each recording of which something is held out, and the recording.

    Where it is the end only, all before it is excluded.
    """
    examples = data.examples
    ends = examples.ends[split.windows.check]
    for number in np.unique(examples.session[ends]).tolist():
        recording = reader.load(Path(data.rows[number].path))
        if not split.held[number]:
            own = np.flatnonzero(examples.session == number)
            first = ends[examples.session[ends] == number].min() - examples.window + 1
            # Examples lack some of the frames, so as many of the last ones are none too early.
            excluded = recording.excluded.copy()
            excluded[: -int((own >= first).sum())] = True
            recording = replace(recording, excluded=excluded)
        yield number, recording
