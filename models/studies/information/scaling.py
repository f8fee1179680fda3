"""Growth of information with taxels, length of the window, rate, and bits of the converter.

Everything is the held-out bound of heldout.py, with the same classifier and as many windows each
time: a sensor, a window or a rate is changed, and nothing else. Fewer taxels are a coarser choice
of the same ones, fewer frames every second or fourth one; more of either can only be simulated.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.recordings.recording import PICOFARAD, Recording
from controller.simulator.readout import ReadoutModel, picofarads
from models.data.examples import Choice
from models.studies.information.windows import Taken, take

KINDS: Final = ("taxels", "window", "rate", "bits")
WINDOWS_S: Final = (0.1, 0.3, 0.6, 1.0, 1.5)
BITS: Final = (4, 5, 6, 8, 12)
SLOWER: Final = (4, 2, 1)  # every so manieth frame
FASTER: Final = (2.0,)  # times the rate, simulated
DENSER: Final = (7,)  # rows and columns, simulated
STEP_S: Final = 0.3  # from one window that is used to the next
EPOCHS: Final = 30
BATCH: Final = 64
TESTED: Final = 2  # days, of all that there are


def worth(taken: Taken) -> dict[str, list[float]]:
    """Return the held-out bounds of a window's label and of a gesture, [value, low, high], nats."""
    from models.studies.information import classifier_bound  # PyTorch

    few = taken.every(max(1, round(STEP_S * taken.rate_hz)))
    square = few.x.shape[2] == few.grid[0] * few.grid[1]
    shape = classifier_bound.Shape.of(few) if square else None
    told = classifier_bound.told(few, epochs=EPOCHS, shape=shape, most=TESTED, batch=BATCH)
    found = {
        "window": classifier_bound.windows(few, told.scaled),
        "gesture": classifier_bound.gestures(few, told),
    }
    return {name: [one.value, one.low, one.high] for name, one in found.items()}


def taxels(taken: Taken, side: int) -> Taken:
    """Return windows of so many rows and columns of the taxels, evenly chosen."""
    rows, columns = (
        np.round((np.arange(min(side, size)) + 0.5) * size / min(side, size) - 0.5).astype(int)
        for size in taken.grid
    )
    chosen = (rows[:, None] * taken.grid[1] + columns).ravel()
    return replace(taken, x=taken.x[:, :, chosen], grid=(len(rows), len(columns)))


def slower(recording: Recording, step: int) -> Recording:
    """Return a recording with every so manieth frame, as if the sensor were as slow as that."""
    if step == 1:
        return recording
    kept = np.arange(step - 1, len(recording.frames), step)
    columns = ("frames", "t", "label", "button", "key", "cue", "excluded", "touch")
    some: dict[str, Any] = {name: getattr(recording, name)[kept] for name in columns}
    some["sequence"] = (recording.sequence[kept] - 1) // step + 1
    some["truth"] = recording.truth and replace(
        recording.truth,
        touch=recording.truth.touch[kept],
        contact=recording.truth.contact[kept],
    )
    origin = replace(recording.origin, rate_hz=recording.origin.rate_hz / step)
    return replace(recording, origin=origin, **some)


def coarser(recording: Recording, bits: int) -> Recording:
    """Return a recording as a converter of fewer bits would have read it.

    Picofarads are taken back to the orb's readings (controller/simulator/readout.py). Of another
    unit nobody knows the full scale: the range of the recording is divided instead.
    """
    frames, levels = recording.frames.astype(np.float64), 2.0**bits
    if recording.origin.unit != PICOFARAD:
        low, high = frames.min(), frames.max()
        step = max(high - low, 1e-12) / (levels - 1.0)
        return replace(recording, frames=_float32(low + np.rint((frames - low) / step) * step))
    origin = recording.origin
    circuit = ReadoutModel().fitted(origin.rows, origin.columns, origin.rate_hz)
    counts = np.clip(np.rint(_reading(frames, circuit, origin.columns) * levels), 1, levels - 1)
    return replace(recording, frames=_float32(picofarads(circuit, counts / levels, origin.columns)))


def windows(recordings: Sequence[Recording], seconds: float, choice: Choice) -> Taken:
    """Return windows of another length."""
    return take(recordings, choice=choice, window_s=seconds)


def _reading(frames: NDArray[np.float64], circuit: ReadoutModel, columns: int) -> Any:
    """Return what was read, of full scale: `readout.picofarads` the other way round."""
    one = picofarads(circuit, np.array(0.25), columns)  # share * load / (1 - share)
    share = 0.25 / (circuit.settled * (1.0 + np.exp(-circuit.discharge_slots)))
    load = float(one) * (1.0 - share) / share
    return frames / (frames + load) * 0.25 / share


def _float32(values: NDArray[np.float64]) -> NDArray[np.float32]:
    return values.astype(np.float32)
