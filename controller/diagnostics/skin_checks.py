"""Checks of the skin from frames that nothing touches; pure."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.diagnostics.report import Row, Verdict
from controller.recognition import drift
from controller.recognition.frames import PreprocessSettings
from controller.recognition.preprocess import Preprocessor
from controller.recordings.quality import taxels
from controller.recordings.recording import PICOFARAD

Frames = NDArray[np.float32]  # (n, rows, columns), pF
Mask = NDArray[np.bool_]  # (rows, columns)

IDLE_S: Final = 6.0  # so long nothing should touch
HOLD_S: Final = (0.6, 3.0)  # of a press, the least and the most
_FINE: Final = 0.02  # scatter of z that is left in the mean of a press
_RESTLESS: Final = 0.15  # mean |z - 1| of a skin that is not at rest
_FALL: Final = 0.012  # of all taxels in four seconds: four times what sound orbs drift by
_MEDIAN: Final = 1.25  # how much more a median scatters than a mean
_STEADY_KPA: Final = 0.02  # what a pressure sensor scatters by
_LEAK_KPA: Final = 0.2  # a minute
_RISE_KPA: Final = 0.01  # that a second of pumping brings at least
_STARTS: Final = 4.0  # of the pump, a minute
_PUMPED_S: Final = 2.0  # of pumping that tell whether it works
_USUAL_PF: Final = (15.0, 120.0)

_ADVICE: Final = {
    "stuck": "Its reading never changes: look at the lead, and at the converter's input.",
    "saturated": "The converter is at its end: check reference and supply.",
    "loose": "Fasten the lead at the membrane.",
    "short": "Look for a solder bridge, or for film that touches.",
    "noisy": "Dry the membrane; if it stays, a contact or the dielectric leaks here.",
}
_CODE: Final = {"loose": "open"}


@dataclass(frozen=True, slots=True)
class PressureReading:
    """The air in one frame.

    Attributes:
        t_s: When.
        kpa: The pressure.
        pumping: Whether the pump shall run.
    """

    t_s: float
    kpa: float
    pumping: bool


def air(samples: Sequence[PressureReading], problem: str) -> list[Row]:
    """Return how pump and hose do.

    Args:
        samples: Frame by frame.
        problem: What the pump's own limits say; "" if nothing.
    """
    last = samples[-1]
    found = f"{last.kpa:.2f} kPa"
    if last.kpa < -0.3:
        advice = "Check supply and lead of the pressure sensor; the pump stays off meanwhile."
        return [Row("pressure", Verdict.FAULT, found, advice, "no_pressure_sensor")]
    still = [a for a in samples if a.pumping == last.pumping]
    for i in range(len(samples) - 1, 0, -1):  # the latest stretch in which the pump did one thing
        if samples[i - 1].pumping != last.pumping:
            still = list(samples[i:])
            break
    seconds = still[-1].t_s - still[0].t_s
    rise = float(np.median([a.kpa for a in still[-5:]]) - np.median([a.kpa for a in still[:5]]))
    if last.pumping and seconds >= _PUMPED_S and rise < _RISE_KPA * seconds:
        advice = "Listen whether it runs; look at its transistor and its hose."
        words = f"{found} after {seconds:.0f} s of pumping"
        return [Row("pump", Verdict.FAULT, words, advice, "pump_dead")]
    if not last.pumping and rise > _STEADY_KPA + _RISE_KPA * seconds:
        advice = "Cut the pump's supply: its transistor does not switch off."
        words = f"the pressure rises to {found} with the pump off"
        return [Row("pump", Verdict.FAULT, words, advice, "pump_stuck")]
    if problem:
        return [Row("pump", Verdict.FAULT, problem, "See docs/hardware.md.", "pump")]
    kpa, minutes = np.array([a.kpa for a in samples]), (last.t_s - samples[0].t_s) / 60.0
    starts = sum(b.pumping and not a.pumping for a, b in pairwise(samples))
    often = starts > 1 + _STARTS * minutes and np.abs(np.diff(kpa)).mean() < _STEADY_KPA
    lost = not last.pumping and -rise > _STEADY_KPA + _LEAK_KPA * seconds / 60.0
    if often or lost:
        words = f"{found}; the pump ran {starts} times in {60.0 * minutes:.0f} s"
        advice = "Look at hose, valve and seam: soap water shows where it bubbles."
        return [Row("air", Verdict.FAULT, words, advice, "air_leak")]
    return [Row("air", Verdict.GOOD, found)]


def rest(frames: Frames, rate_hz: float) -> list[Row]:
    """Return whether anything touched the skin, and whether it drifts; frames at rest, in order."""
    stage = Preprocessor(PreprocessSettings(rate_hz=rate_hz), *frames.shape[1:], mend=False)
    steps = [stage.step(frame) for frame in frames]
    if not any(step.ready for step in steps):
        return [Row(
            "rest", Verdict.FAULT, f"no quiet second in {len(frames) / rate_hz:.0f} s",
            "Take hands and things off the orb, and start again.", "touched",
        )]  # fmt: skip
    middle = float(np.median(frames))
    rows = [Row("rest", Verdict.GOOD, f"scatters by {100 * steps[-1].idle:.1f} %")]
    if not _USUAL_PF[0] < middle < _USUAL_PF[1]:
        rows.append(Row(
            "level", Verdict.DOUBTFUL, f"{middle:.1f} pF, where some 41 are usual",
            "Is the orb inflated, and the right wiring file in use?", "level",
        ))  # fmt: skip
    third = max(1, len(frames) // 3)
    before, after = frames[:third].mean(axis=0), frames[-third:].mean(axis=0)
    if (before > 0.0).all() and (after > 0.0).all():
        causes = drift.causes(before, after)
        minutes = (len(frames) - third) / rate_hz / 60.0
        scatter = float(np.median(frames[:third].std(axis=0) / before))
        noise = scatter * _MEDIAN * np.sqrt(2.0 / (third * before.size))
        if -causes.common > _FALL + 4.0 * noise:
            rows.append(Row(
                "air", Verdict.FAULT,
                f"all taxels lose {-100 * causes.common / minutes:.0f} % a minute",
                "The orb leaks air: look at hose and valve, and pump it up.", "air_leak",
            ))  # fmt: skip
    return rows


def hold_s(idle: Frames, rate_hz: float) -> float:
    """Return how long a press is held, so that noise is averaged out of it, seconds."""
    level = idle.mean(axis=0)
    scatter = float(np.median(idle.std(axis=0) / np.where(level > 0.0, level, np.inf)))
    return float(np.clip((scatter / _FINE) ** 2 / rate_hz, *HOLD_S))


def examine(idle: Frames, touched: Frames, bad: Mask) -> list[Row]:
    """Return what frames say of single taxels.

    Args:
        idle: Frames of the untouched skin, (n, rows, columns).
        touched: Frames under presses here and there; may be none.
        bad: Taxels of which is known that they are of no use.
    """
    frames = np.concatenate([idle, touched])
    level = idle.mean(axis=0)
    change = (frames / np.where(level > 0.01, level, np.inf) - 1.0).astype(np.float32)
    change[:, level <= 0.01] = 0.0
    response = taxels.Response(
        change,
        np.abs(change).mean(axis=(1, 2), dtype=np.float64),
        known=np.ones(len(frames), dtype=np.bool_),
        touched=np.arange(len(frames)) >= len(idle),
    )
    rows = []
    for one in taxels.examine(frames, PICOFARAD, response):
        if one.kind == "dead" or not (one.mask & ~bad).any():
            continue  # the presses that the doctor asks for tell better what feels nothing
        name, _, found = one.text.partition(": ")
        verdict = Verdict.DOUBTFUL if one.kind == "noisy" else Verdict.FAULT
        code = _CODE.get(one.kind, one.kind)
        rows.append(Row(name, verdict, found, _ADVICE[one.kind], code))
        bad |= one.mask if one.useless else False
    return rows
