"""Calibration: taken with care, refused when touched, kept under the device's identity."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from controller.__main__ import main
from controller.diagnostics.calibration import calibrate
from controller.diagnostics.report import Verdict
from controller.sensors import calibration_store
from controller.sensors.calibration_store import Calibration
from tests.support.presses import pressed

REST_PF = np.random.default_rng(2).normal(41.2, 2.9, (5, 5))


def idle(seconds: float = 10.0, noise: float = 0.003) -> NDArray[np.float32]:
    rng = np.random.default_rng(1)
    frames = REST_PF * (1.0 + noise * rng.standard_normal((round(seconds * 10), 5, 5)))
    return frames.astype(np.float32)


def finger(row: int, column: int) -> NDArray[np.float64]:
    return 1.0 + pressed(5, 5, 10.0, (row, column), depth_mm=10.0)


def codes(frames: NDArray[np.floating], last: NDArray[np.float64] | None = None) -> list[str]:
    before = None if last is None else last.astype(np.float32)
    rows, _, _ = calibrate(frames.astype(np.float32), 10.0, before)
    return [row.code for row in rows if row.verdict is not Verdict.GOOD]


def test_a_sensor_at_rest_is_good() -> None:
    rows, rest, noise = calibrate(idle(), 10.0)
    assert [row.verdict for row in rows] == [Verdict.GOOD]
    assert rest == pytest.approx(REST_PF, rel=0.002)
    assert noise == pytest.approx(0.0024, abs=0.0005)


def test_a_hand_that_comes_is_refused() -> None:
    frames = idle()
    frames[40:60] *= finger(2, 2).astype(np.float32)
    assert codes(frames) == ["touched"]


@pytest.mark.parametrize("place", [(2, 2), (1, 3), (4, 4)])
def test_a_lasting_finger_is_refused_where_the_sensor_is_known(place: tuple[int, int]) -> None:
    light = 1.0 - 0.5 * (1.0 - finger(*place))
    frames, last = (idle() * light).astype(np.float32), REST_PF.astype(np.float32)
    rows, rest, _ = calibrate(frames, 10.0, last)
    assert (rest, rows[0].code) == (None, "touched")
    assert rows[0].found.startswith("something seems to lie on it, near taxel")
    assert calibrate(frames, 10.0)[1] is not None


def test_what_is_doubtful_is_said_and_kept() -> None:
    cut = idle()
    cut[:, :, 0] = 1.0
    rows, rest, _ = calibrate(cut, 10.0)
    assert [row.code for row in rows] == ["leads"]
    assert rest is not None
    assert codes(idle(noise=0.15)) == ["noise"]
    assert codes(idle() * np.linspace(1.0, 0.96, 100)[:, None, None]) == ["drift"]
    assert codes(idle() * 0.9, REST_PF) == ["pressure"]
    row = np.ones((5, 5))
    row[3] = 0.8
    assert codes(idle() * row, REST_PF) == ["line"]


def test_a_sensor_of_which_too_much_is_lost_is_refused() -> None:
    cut = idle()
    cut[:, :2] = 1.0
    rows, rest, _ = calibrate(cut, 10.0)
    assert rest is None
    assert rows[0].advice == "Run: controller doctor"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calibration_store, "folder", lambda: tmp_path)


def kept(device_id: str = "orb-1") -> Path:
    return calibration_store.save(device_id, Calibration(REST_PF.astype(np.float32), 0.003, 10.0))


def test_what_was_kept_is_there_again(tmp_path: Path) -> None:
    kept()
    again = calibration_store.load("orb-1")
    assert again is not None
    assert again.rest == pytest.approx(REST_PF, abs=1e-3)
    assert again.idle == 0.003
    assert calibration_store.load("orb-2") is None
    assert calibration_store.forget("orb-1")
    assert calibration_store.load("orb-1") is None


def test_no_device_can_name_a_file_elsewhere(tmp_path: Path) -> None:
    file = kept("../../etc/orb\0")
    assert file.parent == tmp_path
    assert calibration_store.load("../../etc/orb\0") is not None


CHANGES: list[dict[str, object]] = [
    {"rest_pf": [[1.0, -2.0]]}, {"rest_pf": [[1.0], [1.0, 2.0]]}, {"rest_pf": "x"},
    {"idle": float("nan")}, {"rest_pf": [[float("inf")]]}, {"device_id": "orb-2"}, {"version": 2},
]  # fmt: skip
TEXTS = ["", "{", "[]", "null", '{"version": 1}', "[" * 5000]


@pytest.mark.parametrize("change", [*CHANGES, *TEXTS])
def test_a_wrong_calibration_is_ignored(tmp_path: Path, change: str | dict[str, object]) -> None:
    file = kept()
    plain = json.loads(file.read_text())
    file.write_text(change if isinstance(change, str) else json.dumps(plain | change))
    assert calibration_store.load("orb-1") is None


def test_the_command_keeps_a_calibration_and_the_controller_uses_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", "--sensor", "virtual:seed=5"]) == 0
    told = capsys.readouterr().out
    assert told.endswith(f"calibration: good, kept in {tmp_path / 'virtual-5.json'}\n")
    assert main(["calibrate", "--sensor", "virtual:seed=5", "--forget"]) == 0
    assert not list(tmp_path.iterdir())


def test_a_refused_calibration_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    kept("virtual-5")
    before = (tmp_path / "virtual-5.json").read_bytes()
    assert main(["calibrate", "--sensor", "virtual:seed=5,fault=air_leak=0.6"]) == 1
    assert "something moved on it" in capsys.readouterr().out
    assert (tmp_path / "virtual-5.json").read_bytes() == before


def test_wrong_usage_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "--sensor", "virtual:preset=loud"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_noise_of_a_calibration_grows_with_the_rate(tmp_path: Path) -> None:
    rest = np.full((5, 5), 40.0, dtype=np.float32)
    calibration_store.save("orb-1", Calibration(rest, 0.02, rate_hz=10.0))
    kept = calibration_store.load("orb-1")
    assert kept is not None
    assert kept.known(40.0).idle == pytest.approx(0.04)  # a quarter of the time, twice the noise


def test_a_learned_scale_is_kept_in_the_file_of_its_device(tmp_path: Path) -> None:
    assert calibration_store.scale("lines") == 0.0
    calibration_store.keep_scale("lines", 6250.0)
    assert calibration_store.scale("lines") == 6250.0
    assert calibration_store.scale("other") == 0.0
    calibration_store.keep_scale("skin", 6250.0)  # without a name: any sensor's
    assert calibration_store.scale("skin") == 0.0
    assert calibration_store.load("lines") is None  # there is no rest in it
    kept()
    assert calibration_store.scale("orb-1") == 0.0
    assert calibration_store.forget("lines")
    assert calibration_store.scale("lines") == 0.0


@pytest.mark.parametrize("text", [*TEXTS, "nan", "-1", '"much"', "1e300"])
def test_a_wrong_scale_is_ignored(tmp_path: Path, text: str) -> None:
    calibration_store.keep_scale("lines", 6250.0)
    file = calibration_store.path("lines")
    whole = text in TEXTS
    file.write_text(text if whole else file.read_text().replace("6250.0", text))
    assert calibration_store.scale("lines") == 0.0
