"""From stretched capacitors to frames: drift, pressure, faults, and the rolling read-out."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from controller.simulator.readout import ReadoutModel, read, scan_times

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class ElectronicsModel:
    """What the sensor is like apart from its mechanics.

    Attributes:
        readout: The circuit.
        rest_pf: Mean and deviation of the taxels' capacitances: paper, section 3.2.
        pressure: Relative pressure noise.
        taxel_drift: (deviation, time constant in s) of each taxel's own drift.
        common_drift: The same for all taxels together.
        dead: Share of taxels that do not react.
        leaky: Share of taxels that react weakly and noisily.
        jitter_s: Deviation of a scan's start.
    """

    readout: ReadoutModel = field(default_factory=ReadoutModel)
    rest_pf: tuple[float, float] = (41.2, 2.9)
    pressure: float = 0.004
    taxel_drift: tuple[float, float] = (0.012, 120.0)
    common_drift: tuple[float, float] = (0.01, 200.0)
    dead: float = 0.01
    leaky: float = 0.02
    jitter_s: float = 0.001


class Electronics:
    """One orb's taxels and circuit; the same noise for the same seed, however it is cut."""

    def __init__(
        self,
        model: ElectronicsModel,
        grid: tuple[int, int],
        pitch_mm: float,
        rate_hz: float,
        steps_per_frame: int,
        slots: int,
        seed: np.random.SeedSequence,
    ) -> None:
        """Build the orb's taxels.

        Args:
            model: Its constants.
            grid: Rows and columns of taxels.
            pitch_mm: Distance of two taxels.
            rate_hz: Frames per second.
            steps_per_frame: Mechanics steps in a frame.
            slots: Fingers at once.
            seed: Of what differs from orb to orb, and of the noise.
        """
        self._model, self._rate_hz, self._per_frame = model, rate_hz, steps_per_frame
        self._rows, self._columns = grid
        self._pitch_mm = pitch_mm
        self._step_s = 1.0 / (rate_hz * steps_per_frame)
        build, self._drift_noise, self._pressure_noise, self._noise, self._jitter_noise = (
            np.random.default_rng(child) for child in seed.spawn(5)
        )
        taxels = self._rows * self._columns
        self.rest_pf = build.normal(*model.rest_pf, taxels)
        fault = build.random(taxels)
        self._dead = fault < model.dead
        self._leaky = (fault >= model.dead) & (fault < model.dead + model.leaky)
        self._mains_phase = build.uniform(0.0, 2 * np.pi)
        self._drift = self._drift_noise.normal(0.0, model.taxel_drift[0], taxels)
        self._common = float(self._drift_noise.normal(0.0, model.common_drift[0]))
        self._last = np.zeros((2, taxels))  # ln C at the last mechanics steps
        self._tail = np.zeros((2, slots, 3))  # x, y (mm), depth at those steps
        self._previous = np.array(0.3)
        self._scan = scan_times(self._rows, self._columns, model.readout)
        self._frames = 0

    def scan(self, log_c: Array, position: Complex, depth_mm: Array) -> NDArray[np.float32]:
        """Return the frames that were completed, (frames, rows, columns), pF.

        Args:
            log_c: ln(C / C0) at each mechanics step, (frames * steps_per_frame, taxels).
            position: Where fingers hold the skin, complex mm, (steps, slots).
            depth_mm: Their indentations, same shape.
        """
        frames = len(log_c) // self._per_frame
        taxels = self._rows * self._columns
        model = self._model
        track = np.concatenate([self._last, log_c])
        finger = np.stack([position.real, position.imag, depth_mm], axis=-1)
        touched = np.concatenate([self._tail, finger])
        self._last, self._tail = track[-2:].copy(), touched[-2:].copy()
        ends = (np.arange(frames) + 1.0) / self._rate_hz
        jitter = np.abs(self._jitter_noise.normal(0.0, model.jitter_s, frames))
        when = ends[:, None] + self._scan[None, :] - jitter[:, None]
        # Step i of this call ends at (i + 1) * step_s; two older ones stand before it.
        place = np.clip(when / self._step_s + 1.0, 0.0, len(track) - 1.001)
        low = place.astype(int)
        share = place - low
        column = np.arange(taxels)
        values = track[low, column] * (1.0 - share) + track[low + 1, column] * share
        drift = self._wander(frames)
        pressure = self._pressure_noise.normal(0.0, model.pressure, (frames, 1))
        rest = self.rest_pf * (1.0 + drift) * (1.0 + pressure) ** 2
        weak = np.where(self._leaky, 0.6, 1.0) * np.where(self._dead, 0.0, 1.0)
        capacitance = rest * np.exp(values * weak)
        noise = self._noise.normal(0.0, 1.0, (frames, 2, taxels))
        capacitance *= 1.0 + 0.01 * noise[:, 1] * self._leaky
        phase = 2 * np.pi * model.readout.mains_hz * (when + self._frames / self._rate_hz)
        shape = (frames, self._rows, self._columns)
        picofarads, self._previous = read(
            model.readout,
            capacitance.reshape(shape),
            self._rows_touched(touched[2 + self._per_frame - 1 :: self._per_frame]),
            (phase + self._mains_phase).reshape(shape),
            self._previous,
            noise[:, 0].reshape(shape),
        )
        self._frames += frames
        return picofarads.astype(np.float32)

    def _rows_touched(self, finger: Array) -> Array:
        """How much finger lies over each row at each frame's end, (frames, rows), 0 ... 1."""
        rows_y = ((self._rows - 1) / 2 - np.arange(self._rows)) * self._pitch_mm
        near = np.exp(-0.5 * ((finger[:, :, 1, None] - rows_y) / 6.0) ** 2)
        firm = np.minimum(finger[:, :, 2, None] / 5.0, 1.0)
        return np.asarray(np.minimum((near * firm).sum(axis=1), 1.0))

    def _wander(self, frames: int) -> Array:
        """Ornstein-Uhlenbeck drift of every taxel and of all together, (frames, taxels)."""
        taxels = self._rows * self._columns
        deviation, tau_s = self._model.taxel_drift
        common, common_s = self._model.common_drift
        keep = np.exp(-1.0 / (tau_s * self._rate_hz))
        keep_common = np.exp(-1.0 / (common_s * self._rate_hz))
        noise = self._drift_noise.normal(0.0, 1.0, (frames, taxels + 1))
        out = np.empty((frames, taxels))
        for i in range(frames):
            kick = np.sqrt(1 - keep**2) * deviation * noise[i, :-1]
            self._drift = keep * self._drift + kick
            push = np.sqrt(1 - keep_common**2) * common * noise[i, -1]
            self._common = float(keep_common * self._common + push)
            out[i] = self._drift + self._common
        return out
