"""From stretched capacitors to frames: drift, pressure, faults, and the rolling read-out."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.shared.aliases import Array, Complex
from controller.simulator.dome.faults import Fault
from controller.simulator.dome.lowpass import Coloured, Lowpass
from controller.simulator.dome.readout import ReadoutModel, read, scan_times

_WEAK: Final = 0.6  # what is left of a leaky taxel's reaction
_OPEN_PF: Final = 1.0  # a lead that hangs free still couples this much


@dataclass(frozen=True, slots=True)
class ElectronicsModel:
    """Constants of the sensor apart from its mechanics."""

    readout: ReadoutModel = field(default_factory=ReadoutModel)  # the circuit
    rest_pf: tuple[float, float] = (41.2, 2.9)  # mean and deviation: paper, section 3.2
    # Relative noise of the pressure: deviation, and time constant in s.
    pressure: tuple[float, float] = (0.004, 0.05)
    taxel_drift: tuple[float, float] = (0.012, 120.0)  # deviation and time constant in s, of each
    common_drift: tuple[float, float] = (0.01, 200.0)  # the same for all taxels together
    dead: float = 0.01  # share of taxels that do not react
    leaky: float = 0.02  # share of taxels that react weakly and noisily
    leak_noise: tuple[float, float] = (0.01, 0.05)  # their relative noise, the same two
    jitter_s: float = 0.001  # deviation of a scan's start


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
        day: int = 0,
    ) -> None:
        """Build the taxels of a grid, (rows, columns); another day has other drift and noise."""
        self._model, self._rate_hz, self._per_frame = model, rate_hz, steps_per_frame
        self._rows, self._columns = grid
        self._pitch_mm = pitch_mm
        self._step_s = 1.0 / (rate_hz * steps_per_frame)
        self._readout = model.readout.fitted(*grid, rate_hz)
        # One generator for each noise, so that frames asked for singly or together are the same.
        build_seed, *noises = seed.spawn(6)
        if day:
            noises = [
                np.random.SeedSequence(one.entropy, spawn_key=(*one.spawn_key, day))
                for one in noises
            ]
        build = np.random.default_rng(build_seed)
        (
            self._drift_noise,
            self._pressure_noise,
            self._noise,
            self._jitter_noise,
            self._leak_generator,
        ) = (np.random.default_rng(one) for one in noises)
        taxels = self._rows * self._columns
        self.rest_pf = build.normal(*model.rest_pf, taxels)
        fault = build.random(taxels)
        self._strength = np.where(fault < model.dead, 0.0, 1.0)
        leaky = (fault >= model.dead) & (fault < model.dead + model.leaky)
        self._strength[leaky] = _WEAK
        self._leak_noise = np.where(leaky, model.leak_noise[0], 0.0)
        self._pressure = Coloured(1, model.pressure[1] * rate_hz, self._pressure_noise)
        self._leak = Coloured(taxels, model.leak_noise[1] * rate_hz, self._leak_generator)
        self._mains_phase = build.uniform(0.0, 2 * np.pi)
        # Drift of each taxel, and of all together as one more column.
        drift_sd = np.append(np.full(taxels, model.taxel_drift[0]), model.common_drift[0])
        taus = np.append(np.full(taxels, model.taxel_drift[1]), model.common_drift[1])
        keep = np.exp(-1.0 / (taus * rate_hz))
        self._kick = np.sqrt(1.0 - keep**2) * drift_sd
        start = self._drift_noise.normal(0.0, 1.0, taxels + 1) * drift_sd
        self._drift = Lowpass(keep, start)
        self._last = np.zeros((2, taxels))  # ln C at the last mechanics steps
        self._tail = np.zeros((2, slots, 3))  # x, y (mm), depth at those steps
        self._previous = np.array(0.3)
        self._scan = scan_times(self._rows, self._columns, self._readout)
        # What a scan of the latest frame met: capacitances, pF, and fingers over rows, 0 ... 1.
        self.skin = self.rest_pf.reshape(grid), np.zeros(self._rows)
        self._frames = 0
        self._since: dict[Fault, int] = {}  # fault -> frame in which it was switched on

    def switch(self, faults: Iterable[Fault], on: bool = True) -> None:
        """Switch faults on or off; what leaks or drifts begins anew."""
        for fault in faults:
            if on:
                self._since.setdefault(fault, self._frames)
            else:
                self._since.pop(fault, None)

    def scan(self, log_c: Array, position: Complex, depth_mm: Array) -> NDArray[np.float32]:
        """Return the frames that were completed, (frames, rows, columns), pF.

        At each mechanics step: ln(C / C0), (steps, taxels), where fingers hold the skin, complex
        mm, and their indentations, (steps, slots).
        """
        frames = len(log_c) // self._per_frame
        track = np.concatenate([self._last, log_c])
        finger = np.stack([position.real, position.imag, depth_mm], axis=-1)
        touched = np.concatenate([self._tail, finger])
        self._last, self._tail = track[-2:].copy(), touched[-2:].copy()
        when = self._slots_s(frames)
        capacitance = self._capacitance(self._at(track, when), frames)
        shape = (frames, self._rows, self._columns)
        fingers = self._rows_touched(touched[1 + self._per_frame :: self._per_frame])
        if frames:
            self.skin = capacitance[-1].reshape(shape[1:]).copy(), fingers[-1]
        circuit = self._circuit()
        phase = 2 * np.pi * circuit.mains_hz * (when + self._frames / self._rate_hz)
        picofarads, self._previous = read(
            circuit,
            self._broken(capacitance).reshape(shape),
            fingers,
            (phase + self._mains_phase).reshape(shape),
            self._previous,
            self._noise.normal(0.0, 1.0, shape),
        )
        self._frames += frames
        return picofarads.astype(np.float32)

    def _slots_s(self, frames: int) -> Array:
        """When each taxel is read, seconds from the start of this call, (frames, taxels)."""
        late_s = self._model.jitter_s + sum(f.size for f in self._since if f.kind == "jitter")
        ends = (np.arange(frames) + 1.0) / self._rate_hz
        late = np.abs(self._jitter_noise.normal(0.0, late_s, frames))
        # A loop that is late scans old skin; more than a frame late is a missed frame.
        return ends[:, None] + self._scan[None, :] - np.minimum(late, 0.5 / self._rate_hz)[:, None]

    def _at(self, track: Array, when: Array) -> Array:
        """Interpolate ln C to the slots, (frames, taxels)."""
        # Step i of this call ends at (i + 1) * step_s; two older ones stand before it.
        place = np.maximum(when / self._step_s + 1.0, 0.0)
        low = np.minimum(place.astype(int), len(track) - 2)
        share = place - low
        taxel = np.arange(track.shape[1])
        values = track[low, taxel] * (1.0 - share) + track[low + 1, taxel] * share
        return np.asarray(values, dtype=np.float64)

    def _capacitance(self, log_c: Array, frames: int) -> Array:
        """Return what the skin's capacitances truly are at their slots, pF, (frames, taxels)."""
        strength, noise_sd = self._strength, self._leak_noise
        for fault in self._since:
            taxel = fault.row * self._columns + fault.column
            if fault.kind == "dead":
                strength = strength.copy()
                strength[taxel] = 0.0
            elif fault.kind == "leaky":
                strength, noise_sd = strength.copy(), noise_sd.copy()
                strength[taxel], noise_sd[taxel] = _WEAK, fault.size
        pressure = 1.0 + self._model.pressure[0] * self._pressure.advance(frames)
        warmth = np.ones((frames, 1))
        for fault, since in self._since.items():
            minutes = (self._frames - since + np.arange(1, frames + 1)) / (60.0 * self._rate_hz)
            if fault.kind == "air_leak":
                pressure = pressure * np.exp(-fault.size * minutes)[:, None]
            elif fault.kind == "temperature":
                warmth = warmth + (fault.size * minutes)[:, None]
        rest = self.rest_pf * (1.0 + self._wander(frames)) * warmth * pressure**2
        leak = 1.0 + noise_sd * self._leak.advance(frames)
        return np.asarray(rest * np.exp(log_c * strength) * leak)

    def _broken(self, capacitance: Array) -> Array:
        """Return capacitances behind open and shorted leads, (frames, rows, columns), pF."""
        grid = capacitance.reshape(-1, self._rows, self._columns)
        for fault in self._since:
            r, c = fault.row, fault.column
            if fault.kind == "open_row":
                grid[:, r] = _OPEN_PF
            elif fault.kind == "open_column":
                grid[:, :, c] = _OPEN_PF
            elif fault.kind == "short_row":
                grid[:, r : r + 2] = grid[:, r : r + 2].sum(axis=1, keepdims=True)
            elif fault.kind == "short_column":
                grid[:, :, c : c + 2] = grid[:, :, c : c + 2].sum(axis=2, keepdims=True)
        return grid

    def _circuit(self) -> ReadoutModel:
        """Return the circuit as it is now."""
        circuit = self._readout
        for fault in self._since:
            if fault.kind == "saturation":
                circuit = replace(circuit, ceiling=fault.size * circuit.usual)
            elif fault.kind == "mains":
                circuit = replace(circuit, mains=circuit.mains + fault.size)
        return circuit

    def _rows_touched(self, finger: Array) -> Array:
        """Return the share of fingers over each row at the frame's end, (frames, rows), 0 to 1."""
        rows_y = ((self._rows - 1) / 2 - np.arange(self._rows)) * self._pitch_mm
        near = np.exp(-0.5 * ((finger[:, :, 1, None] - rows_y) / 6.0) ** 2)
        firm = np.minimum(finger[:, :, 2, None] / 5.0, 1.0)
        return np.asarray(np.minimum((near * firm).sum(axis=1), 1.0))

    def _wander(self, frames: int) -> Array:
        """Ornstein-Uhlenbeck drift of every taxel and of all together, (frames, taxels)."""
        kick = self._drift_noise.normal(0.0, 1.0, (frames, len(self._kick)))
        drift = self._drift.advance(kick * self._kick)
        return drift[:, :-1] + drift[:, -1:]
