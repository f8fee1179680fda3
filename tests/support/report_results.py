"""Results of a training, a tuning and an evaluation, made up for tests of the report."""

from dataclasses import replace

from models.results import evaluation as judged
from models.results import training as learned
from models.results.evaluation import Calibration as Judged

LABELS = ("null", "press", "pinch")


def session(number: int = 1, **more: object) -> learned.SessionRow:
    late = learned.Lateness(0.1, 0.05, 40, 1, 200, 9)
    row = learned.SessionRow(
        f"data/sub-01_ses-{number:02d}_run-01.npz", "01", f"{number:02d}", 180.0, "good", (),
        "button", False, {"press": 20, "pinch": 14}, late,
    )  # fmt: skip
    return replace(row, **more)  # type: ignore[arg-type]


def training(**more: object) -> learned.Training:
    epochs = tuple(learned.Epoch(i, 1 / i, 1 - 0.5 / i, 1.2 / i, 0.95 - 0.4 / i, 1 - 0.4 / i)
                   for i in range(1, 9))  # fmt: skip
    gesture = learned.GestureResult(
        epochs, learned.HeldOutScore(0.912, 0.9, 0.92, 0.979), 0.99,
        ((900, 3, 0), (2, 95, 3), (0, 5, 90)), ((0, 0, 0), (0, 19, 1), (0, 0, 14)),
        learned.Calibration(0.9, 0.02, 0.01, ((0.55, 0.5, 20), (0.97, 0.98, 900))), 202_445,
    )  # fmt: skip
    location = learned.LocationResult(
        epochs, learned.HeldOutScore(0.12, 0.11, 0.13, 0.08),
        ((1.2, 3.1, 0.1, -0.05), (0.0, 0.0, 0.2, 0.1)), 0.1, 0.13, 58_210,
    )  # fmt: skip
    classes = (
        learned.ClassRow("null", 0, 540.0, 0.995, 0.99),
        learned.ClassRow("press", 80, 53.0, 0.95, 0.92, 0.95),
        learned.ClassRow("pinch", 76, 62.0, 0.95, 0.97, 1.0),
    )  # fmt: skip
    made = learned.Training(
        "my.orb", "models train data --out my.orb", "0.1.0", "default", ("rest: followed",), 5, 5,
        10.0, 10.0, "pF", LABELS, "mine", "1 of 3 sessions held out", ("turned: press",),
        (session(1), session(2), session(3, held_out=True)), classes, gesture, location,
        ("40 more of press would help",), {"on": 0.85},
    )  # fmt: skip
    return replace(made, **more)  # type: ignore[arg-type]


def figure(value: float) -> judged.Figure:
    return judged.Figure(value, value - 0.01, value + 0.005)


def evaluation(name: str = "nominal", sessions: int = 4) -> judged.Evaluation:
    rows = tuple(judged.Row(f"sub-09_ses-{i:02d}_run-01", 1, 50, 0.99, 1.0, 0.95, 0.01, 0.33, 0.1)
                 for i in range(sessions))  # fmt: skip
    one = figure(0.98)
    place = judged.LocationFigures(one, one, one, 0.09, 0.3)
    classes = tuple(judged.ClassFigures(label, 60, one, one, one) for label in LABELS[1:])
    result = judged.Result(
        name, LABELS, sessions, 2, 120, 24.0, 15.0, one, one, one, one, one, one, figure(0.02), one,
        0.5, one, 0.6, one, one, one, ((0, 1, 0), (1, 58, 1), (0, 0, 60)),
        classes, Judged(0.008, ((0.97, 0.98, 900),)), place,
        rows, rows[:2],
    )  # fmt: skip
    return judged.Evaluation("my.orb", "ab" * 32, {"made": "by hand"}, "models evaluate", LABELS,
                      {"on": 0.85}, (result,))  # fmt: skip
