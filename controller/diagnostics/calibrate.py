"""`controller calibrate`: take the rest image with care, judge it, and keep it."""

import argparse
import json
import logging
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.diagnostics.frame_source import Watch
from controller.diagnostics.report import Row, Verdict, faulty, table
from controller.diagnostics.touch_checks import pressed
from controller.recognition import drift
from controller.recognition.dead_taxels import MOST, Filler
from controller.recognition.preprocess import LEAST_REST, Frame, Preprocessor, PreprocessSettings
from controller.recognition.taxel_text import names
from controller.sensors import base as sensors
from controller.sensors import calibration_store
from controller.sensors.base import SensorOptions
from controller.sensors.calibration_store import Calibration
from controller.simulator.presets import PRESETS

Frames = NDArray[np.float32]
Change = NDArray[np.float64]

SECONDS: Final = 10.0  # paper, section 4.1
_SETTLES_S: Final = 2.0  # at most, until the first second is still
_MOVES_S: Final = 0.3  # so long something has to be felt
# Of 400 simulated orbs that were never calibrated 1.5 % look so much like pressed ones, and none
# beyond the second; of 400 that a finger presses 8 mm deep 75 % and 38 % do.
_LIKELY, _SURE = 3.5, 4.5
_DEEP: Final = 0.5  # of a press 8 mm deep
_LARGE: Final = 100  # taxels: beyond, nobody has tried
_PITCH_MM: Final = 10.0
_NOISY: Final = 0.09  # mean |z - 1|; a preset as noisy as the paper's figures imply has 0.05
_MOVED: Final = 0.012  # what rest may drift meanwhile
_OTHER: Final = 0.08  # ln C against the last calibration: of all taxels, of a line
_LINE: Final = 0.15


def main(argv: Sequence[str]) -> int:
    """Run `controller calibrate`; exit status 0: kept, 1: not kept, 2: wrong usage."""
    options = _parser().parse_args(argv)
    logging.basicConfig(format="%(message)s", level=logging.INFO, stream=sys.stderr)
    wish = SensorOptions(
        seed=options.seed, preset=options.preset, faults=tuple(options.fault),
        wiring=options.wiring,
    )  # fmt: skip
    sensor = sensors.load(options.sensor, wish)
    try:
        if options.forget:
            there = calibration_store.forget(sensor.device_id)
            print(f"{sensor.device_id}: {'forgotten' if there else 'nothing was kept'}")
            return 0
        if not sensor.virtual:
            print(f"hands off the orb for {SECONDS:.0f} seconds ...", file=sys.stderr)
        frames = Watch(sensor).frames(SECONDS)
        last = calibration_store.load(sensor.device_id)
        before = None if last is None else last.rest
        rows, rest, idle = judge(frames, sensor.rate_hz, before, anyway=options.anyway)
        kept = None if rest is None else _keep(sensor.device_id, rows, rest, idle)
    finally:
        sensor.close()
    _show(rows, kept, as_json=options.json)
    return 0 if kept else 1


def judge(
    frames: Frames, rate_hz: float, last: Frame | None = None, *, anyway: bool = False
) -> tuple[list[Row], Frame | None, float]:
    """Return what is to be said of a calibration, its rest image (None: refused) and its noise.

    Args:
        frames: Of a sensor that nobody should have touched, (n, rows, columns), pF.
        rate_hz: Frames per second.
        last: What the same sensor read when it was calibrated before.
        anyway: Keep it although something seems to lie there.
    """
    stage = Preprocessor(PreprocessSettings(rate_hz=rate_hz), *frames.shape[1:], mend=False)
    steps = [stage.step(frame) for frame in frames]
    late = not any(step.ready for step in steps[: max(1, round((1.0 + _SETTLES_S) * rate_hz))])
    restless = [step.ready and not step.quiet for step in steps]
    run = max(2, round(_MOVES_S * rate_hz))
    if late or any(all(restless[i : i + run]) for i in range(len(steps) - run + 1)):
        return [_refused("something moved on it")], None, 0.0
    rest = frames.mean(axis=0)
    lost = rest < LEAST_REST * np.median(rest)
    if not (rest > 0.0).any() or lost.mean() > MOST:
        words = "no taxel reads anything" if lost.all() else f"{names(lost)}: no signal"
        return [Row("rest", Verdict.FAULT, words, "Run: controller doctor", "leads")], None, 0.0
    sure, place = _lies(rest, lost, last)
    if sure > _SURE and not anyway:
        return [_refused(f"something seems to lie on it, near {place}")], None, 0.0
    rows = [*_doubts(frames, rest, lost, steps[-1].idle), *_changes(rest, last, lost)]
    if sure > _LIKELY:
        words = f"something may lie on it, near {place}"
        advice = "If so, take it off and calibrate again."
        rows.append(Row("touch", Verdict.DOUBTFUL, words, advice, "touched"))
    if not rows:
        words = f"{rest[~lost].mean():.1f} pF (SD {rest[~lost].std():.1f})"
        rows = [Row("rest", Verdict.GOOD, f"{words}, scatters by {100 * steps[-1].idle:.1f} %")]
    return rows, np.maximum(rest, 0.01).astype(np.float32), steps[-1].idle


def _refused(why: str) -> Row:
    advice = "Take hands and things off the orb, and calibrate again."
    return Row("rest", Verdict.FAULT, why, advice, "touched")


def _lies(rest: Frame, lost: NDArray[np.bool_], last: Frame | None) -> tuple[float, str]:
    """Return how sure something lies on the skin since the first frame, and where.

    Where the sensor was calibrated before, the change since then shows it. Where not, taxels that
    differ by 7 % from the start have to look like a simulated press (standard deviations).
    """
    now = rest.astype(np.float64)
    if last is not None and last.shape == rest.shape and (last > 0.0).all():
        z = now / last
        change = _filled(z / np.median(z[~lost]) - 1.0, lost)
        row, column = np.unravel_index(int(change.argmin()), change.shape)
        firm = float(np.abs(change).mean()) > PreprocessSettings().gate
        sure = firm and drift.shape(change) == "touch"
        return float("inf") if sure else 0.0, f"taxel ({row},{column})"
    change = _filled(now / np.median(now[~lost]) - 1.0, lost)
    if rest.size > _LARGE:
        return 0.0, ""
    best = (0.0, "")
    change = change - change.mean()
    for row, column in np.ndindex(*rest.shape):
        press = pressed(rest.shape[0], rest.shape[1], _PITCH_MM, (row, column))
        press = press - press.mean()
        power = float(np.square(press).sum())
        depth = float((press * change).sum()) / power
        error = float((change - depth * press).std(ddof=2)) / np.sqrt(power)
        if depth > _DEEP:
            best = max(best, (depth / max(error, 1e-9), f"taxel ({row},{column})"))
    return best


def _filled(change: Change, lost: NDArray[np.bool_]) -> Change:
    return Filler(*change.shape).fill(change, lost) if lost.any() else change


def _doubts(frames: Frames, rest: Frame, lost: NDArray[np.bool_], idle: float) -> list[Row]:
    """Return what is wrong with the sensor, though it can be played on."""
    rows = []
    if lost.any():
        words = f"{names(lost)}: no signal; play goes on without"
        rows.append(Row("leads", Verdict.DOUBTFUL, words, "Run: controller doctor", "leads"))
    if idle > _NOISY:
        words = f"readings scatter by {100 * idle:.0f} %"
        rows.append(Row("noise", Verdict.DOUBTFUL, words, "Run: controller doctor", "noise"))
    third = max(1, len(frames) // 3)
    ends = frames[:third].mean(axis=0), frames[-third:].mean(axis=0)
    moved = np.log(np.maximum(ends[1], 0.01) / np.maximum(ends[0], 0.01))[~lost]
    limit = _MOVED + 4.0 * idle / np.sqrt(third * moved.size)
    if abs(float(np.median(moved))) > limit:
        words = f"all taxels drifted by {100 * np.median(moved):+.1f} % in {SECONDS:.0f} s"
        advice = "Wait until the orb is inflated and warm; does it leak?"
        rows.append(Row("drift", Verdict.DOUBTFUL, words, advice, "drift"))
    return rows


def _changes(rest: Frame, last: Frame | None, lost: NDArray[np.bool_]) -> list[Row]:
    """Return how rest has changed since the last time, by cause; information, no complaint."""
    if last is None or last.shape != rest.shape or lost.any() or not (last > 0.0).all():
        return []
    why, rows = drift.causes(last, np.maximum(rest, 0.01)), []
    if abs(why.common) > _OTHER:
        words = f"all taxels {100 * np.expm1(why.common):+.0f} % since the last time"
        advice = "Pump the orb to its usual pressure." if why.common < 0 else ""
        rows.append(Row("pressure", Verdict.DOUBTFUL, words, advice, "pressure"))
    for word, sizes in (("row", why.rows), ("column", why.columns)):
        for i in np.flatnonzero(np.abs(sizes) > _LINE).tolist():
            words = f"{100 * np.expm1(sizes[i]):+.0f} % against the others since the last time"
            rows.append(Row(f"{word} {i}", Verdict.DOUBTFUL, words, "Look at its lead.", "line"))
    return rows


def _keep(device_id: str, rows: Sequence[Row], rest: Frame, idle: float) -> Path:
    verdict = "good" if all(row.verdict is Verdict.GOOD for row in rows) else "doubtful"
    made = datetime.now(UTC).isoformat(timespec="seconds")
    return calibration_store.save(Calibration(device_id, rest, idle, made, verdict))


def _show(rows: Sequence[Row], kept: Path | None, *, as_json: bool) -> None:
    verdict = "failed" if faulty(rows) else (
        "good" if all(row.verdict is Verdict.GOOD for row in rows) else "doubtful"
    )  # fmt: skip
    if as_json:
        plain = {
            "verdict": verdict, "kept": None if kept is None else str(kept),
            "rows": [row.plain() for row in rows],
        }  # fmt: skip
        print(json.dumps(plain))
        return
    print(table(rows))
    print(f"calibration: {verdict}" + ("" if kept is None else f", kept in {kept}"))


def _parser() -> argparse.ArgumentParser:
    grammar = argparse.ArgumentParser(
        prog="controller calibrate",
        description="Take the rest image of the untouched orb for ten seconds, judge it, and keep "
        "it: the controller then begins sooner, and notices a finger that is there from the start. "
        "Exit status 0: kept; 1: refused.",
        epilog="Try it without hardware: controller calibrate --sensor virtual",
        formatter_class=lambda prog: argparse.HelpFormatter(prog, max_help_position=18),
    )
    add = grammar.add_argument
    add("--sensor", metavar="NAME", default="virtual",
        help=f"which: {', '.join(sensors.names())} (default: virtual)")  # fmt: skip
    add("--wiring", metavar="FILE", type=Path,
        help="what hangs on which pin (default: as docs/hardware.md draws it)")  # fmt: skip
    add("--anyway", action="store_true",
        help="keep it although something seems to lie on the orb")  # fmt: skip
    add("--forget", action="store_true", help="remove what is kept of this sensor instead")
    add("--json", action="store_true", help="print one JSON object")
    add("--seed", metavar="N", type=int, default=1, help="which orb is simulated (default: 1)")
    add("--preset", metavar="NAME", default="nominal",
        help=f"the virtual orb's quality: {', '.join(PRESETS)} (default: nominal)")  # fmt: skip
    add("--fault", metavar="FAULT", action="append", default=[],
        help="break the simulated orb: docs/simulator.md")  # fmt: skip
    return grammar
