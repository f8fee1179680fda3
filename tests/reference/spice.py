"""The circuit of figure 4b in ngspice, with all that hangs on it: truth for the orb's driver.

Shares no line with `controller.sensors.hardware`: films are ladders of resistors, pins and the
converter's sampling switch are switches with edges; everything is integrated by ngspice.
"""

import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from controller.shared.aliases import Array

SUPPLY_V: Final = 3.3
EDGE_S: Final = 50e-9  # of every switch
SAMPLE_S: Final = 1.5e-6  # the converter's sampling time


@dataclass(frozen=True)
class Parts:
    """One orb's parts."""

    taxels_pf: Array  # (rows, columns)
    film_ohm: Array  # end to end of columns, then rows, (columns + rows,)
    stray_pf: Array  # at the board ends, same order
    row_pf: Array  # capacitor from each row to ground
    bleed_ohm: Array  # R_m of each row, to ground
    leak_a: Array  # into each row, from pin and converter
    gate_pf: float = 0.1  # from a row pin's gate to the row: what it injects as it lets go
    sample_pf: float = 20.0  # the converter's sampling capacitor
    input_pf: float = 7.0  # its pin
    coupling_pf: float | None = None  # C_m, in series between row and converter; None: bridged
    buffered: bool = False  # a follower stands before the converter

    @property
    def rows(self) -> int:
        return int(self.taxels_pf.shape[0])

    @property
    def columns(self) -> int:
        return int(self.taxels_pf.shape[1])


def draw(rng: np.random.Generator, rows: int = 5, columns: int = 5) -> Parts:
    """Return a random orb: paper, section 3, and tolerances that parts usually have."""
    return Parts(
        taxels_pf=rng.normal(41.2, 2.9, (rows, columns)),
        film_ohm=1000.0 * np.exp(rng.normal(0.0, 0.3, columns + rows)),
        stray_pf=rng.uniform(14.0, 22.0, columns + rows),
        row_pf=100.0 * (1.0 + 0.02 * rng.uniform(-1.0, 1.0, rows)),
        bleed_ohm=50e6 * (1.0 + 0.02 * rng.uniform(-1.0, 1.0, rows)),
        leak_a=rng.normal(0.0, 1e-9, rows),
    )


@dataclass
class Timeline:
    """When switches close, seconds; each begins open (a column: low)."""

    end_s: float = 0.0
    closed: dict[str, list[tuple[float, float]]] = field(default_factory=dict)

    def close(self, name: str, from_s: float, to_s: float) -> None:
        """Close a switch (raise a column) for a while."""
        self.closed.setdefault(name, []).append((from_s, to_s))
        self.end_s = max(self.end_s, to_s)

    def source(self, name: str, node: str, high_v: float = 1.0) -> str:
        """Return the source that controls a switch, high while it is closed."""
        closed = sorted(self.closed.get(name, []))
        points = [f"0 {high_v if closed and closed[0][0] <= 0.0 else 0}"]
        for start, stop in closed:
            if start > 0.0:
                points += [f"{start:.9g} 0", f"{start + EDGE_S:.9g} {high_v}"]
            points += [f"{stop:.9g} {high_v}", f"{stop + EDGE_S:.9g} 0"]
        return f"V{name} {node} 0 PWL({' '.join(points)})"


def netlist(parts: Parts, timeline: Timeline, step_s: float = 5e-6) -> str:
    """Return what ngspice simulates. Switches: `g0` grounds row 0, `s0` samples it, `z` empties."""
    lines = ["* figure 4b with all its taxels"]
    add = lines.append
    columns, rows = parts.columns, parts.rows
    for i in range(columns):
        add(timeline.source(f"c{i}", f"pin{i}", SUPPLY_V))
        add(f"Rc{i} pin{i} cb{i} 50.001")
        add(f"Ccb{i} cb{i} 0 {parts.stray_pf[i]}p")
        lines += _film("c", i, rows, float(parts.film_ohm[i]))
    for j in range(rows):
        add(timeline.source(f"g{j}", f"gate{j}"))
        add(f"Sg{j} rb{j} 0 gate{j} 0 pin")
        add(f"Cg{j} gate{j} rb{j} {parts.gate_pf * SUPPLY_V}p")
        add(f"Crb{j} rb{j} 0 {parts.row_pf[j] + parts.stray_pf[columns + j]}p")
        add(f"Il{j} 0 rb{j} {parts.leak_a[j]}")
        add(f"Rm{j} rb{j} 0 {parts.bleed_ohm[j]}")
        lines += _film("r", j, columns, float(parts.film_ohm[columns + j]))
        lines += _input(parts, j)
        add(timeline.source(f"s{j}", f"take{j}"))
        add(f"Ss{j} in{j} adc take{j} 0 mux")
    for j in range(rows):
        for i in range(columns):
            add(f"Ct{j}_{i} c{i}_{j} r{j}_{i} {parts.taxels_pf[j, i]}p")
    add(timeline.source("z", "empty"))
    add("Sz adc 0 empty 0 mux")
    add(f"Cs adc 0 {parts.sample_pf}p")
    add(".model pin sw vt=0.5 vh=0 ron=50 roff=1e12")
    add(".model mux sw vt=0.5 vh=0 ron=1000 roff=1e13")
    add(".options method=gear reltol=1e-5 abstol=1e-14 chgtol=1e-16 vntol=1e-6 gmin=1e-16")
    add(".ic v(adc)=0")
    add(f".tran {step_s} {timeline.end_s + 20e-6} 0 {step_s}")
    return "\n".join(lines)


def _film(kind: str, number: int, taxels: int, ohm: float) -> Iterable[str]:
    """Yield an electrode: a lead of a third of its resistance, then a ladder along its taxels."""
    before, part = f"{kind}b{number}", ohm / 3.0
    for k in range(taxels):
        here = f"{kind}{number}_{k}"
        yield f"R{kind}{number}_{k} {before} {here} {part}"
        yield f"Cf{kind}{number}_{k} {here} 0 {5.0 / taxels}p"
        before, part = here, ohm * 2.0 / 3.0 / max(taxels - 1, 1)


def _input(parts: Parts, j: int) -> Iterable[str]:
    """Yield what is between a row and the converter's switch."""
    node = f"rb{j}"
    if parts.coupling_pf is not None:
        yield f"Cm{j} {node} rm{j} {parts.coupling_pf}p"
        node = f"rm{j}"
    if parts.buffered:
        yield f"Cb{j} {node} 0 3p"  # of a follower with an input of a picoampere
        yield f"Rb{j} {node} 0 1e9"
        yield f"Eb{j} follow{j} 0 {node} 0 1"
        yield f"Ro{j} follow{j} in{j} 100"
    else:
        yield f"Ri{j} {node} in{j} 0.001"
        yield f"Ci{j} in{j} 0 {parts.input_pf}p"
        if parts.coupling_pf is not None:  # what the converter's input leaks flows here
            yield f"Ii{j} 0 in{j} {parts.leak_a[j]}"
            yield f"Rx{j} in{j} 0 1e12"


def run(circuit: str, nodes: Sequence[str]) -> tuple[Array, Array]:
    """Return times, (steps,), and the voltages of nodes then, (steps, nodes)."""
    with tempfile.TemporaryDirectory() as folder:
        deck, raw = Path(folder) / "deck.cir", Path(folder) / "out.raw"
        save = " ".join(f"v({node})" for node in nodes)
        deck.write_text(f"{circuit}\n.save {save}\n.end\n", encoding="ascii")
        done = subprocess.run(
            ["ngspice", "-b", "-r", raw, deck], capture_output=True, text=True, check=False
        )
        if done.returncode or not raw.exists():
            raise RuntimeError(f"ngspice fails: {done.stdout[-400:]}{done.stderr[-400:]}")
        return _raw(raw.read_bytes(), nodes)


def _raw(data: bytes, nodes: Sequence[str]) -> tuple[Array, Array]:
    """Return the times and voltages of a binary raw file."""
    head, _, body = data.partition(b"Binary:\n")
    words = head.decode().splitlines()
    count = next(int(line.split(":")[1]) for line in words if line.startswith("No. Variables"))
    names = [line.split()[1] for line in words[words.index("Variables:") + 1 :][:count]]
    table = np.frombuffer(body, dtype=np.float64)
    table = table[: len(table) // count * count].reshape(-1, count)
    return table[:, 0], table[:, [names.index(f"v({node})") for node in nodes]]


def at(times: Array, values: Array, when: Array) -> Array:
    """Return values at given times, linearly between the steps, (when, nodes)."""
    return np.stack([np.interp(when, times, column) for column in values.T], axis=1)
