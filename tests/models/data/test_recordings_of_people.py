"""Training on recordings of people on other sensors: each file is used, or is named."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from controller.recordings import edit, importer, writer
from controller.recordings.description import Description
from controller.recordings.recording import Recording
from models.data import load
from models.data.recipe import DEFAULT
from tests.support.other_sensors import NAMES, Sensor, bursts, recorded, ticks


def imported(person: int, sensor: Sensor, clock: str = "") -> Recording:
    arrays = recorded(sensor, person)
    clocks = {"": lambda t: t, "ticks": ticks, "bursts": bursts}
    described = Description(
        frames="frames", pitch_mm=5.0, unit="counts", time="t", label="label", label_names=NAMES,
        null="rest", labeller="cue", user=f"{person:02d}", even_times=clock == "bursts",
    )  # fmt: skip
    [made] = importer.recordings({**arrays, "t": clocks[clock](arrays["t"])}, described)
    return made


def test_every_file_is_used_or_named(tmp_path: Path) -> None:
    falling = Sensor(level=30_000.0, change=-210.0, noise=4.0, touches=8)
    held = replace(falling, hold_s=10.0, touches=4)
    good = [
        imported(1, falling),
        imported(2, held),
        imported(3, falling, "ticks"),
        imported(4, falling, "bursts"),
        imported(5, replace(held, begins_touched=True, pause_s=4.0)),
    ]
    for number, one in enumerate(good):
        (tmp_path / f"good-{number}.npz").write_bytes(edit.sealed(one))
    rng, shape = np.random.default_rng(3), good[1].frames.shape
    unfelt = replace(  # named a tap all the time, and nothing touched
        good[1],
        frames=(30_000.0 + rng.normal(0.0, 4.0, shape)).astype(np.float32),
        cue=np.ones(len(good[1].t), dtype=np.int16),
    )
    (tmp_path / "unfelt.npz").write_bytes(writer.pack(unfelt))
    (tmp_path / "other-rate.npz").write_bytes(
        writer.pack(imported(6, replace(falling, rate_hz=14.0)))
    )
    (tmp_path / "other-grid.npz").write_bytes(writer.pack(imported(7, replace(falling, rows=5))))
    (tmp_path / "damaged.npz").write_bytes(b"PK")
    found = load.read([tmp_path], DEFAULT, "auto", lambda line: None)
    assert {Path(row.path).stem for row in found.rows} == {f"good-{n}" for n in range(5)}
    notes = " ".join(found.notes)
    for name in ("unfelt", "other-rate", "other-grid", "damaged"):
        assert f"{tmp_path / name}.npz is left out: " in notes
    assert found.notes[-1].startswith("label repair changed 0.7 % of the frames")
    assert len(found.notes) == 5
    assert "it is meant for 14 Hz, others for 40 Hz (--all takes it" in notes
    assert set(np.unique(found.examples.label)) >= {0, 1, 2}


def test_the_names_of_the_orb_s_gestures_mean_nothing_on_other_sensors() -> None:
    counts = replace(imported(1, Sensor()).origin, sign=-1)
    assert not load.of_orb(counts)
    skin = replace(counts, unit="pF", rows=27, columns=15)
    assert not load.of_orb(skin)
    assert load.of_orb(replace(skin, hardware="virtual orb"))
    assert load.of_orb(replace(skin, rows=5, columns=5))
