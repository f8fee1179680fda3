"""The sections of a report about what a network learned: classes, labels, probabilities, places."""

import math

from models import text
from models.reports import charts, maps
from models.results.evaluation import Evaluation
from models.results.training import ClassRow, GestureResult, Training


def classes(found: Training) -> str:
    """Return what became of each class, and whether there is enough of it."""
    if found.gesture is None:
        return ""
    head = (
        "gesture",
        "enough?",
        "examples",
        "time",
        "windows found",
        "windows precise",
        "gestures found",
        "answered",
        "with more",
    )
    rows = [
        (
            text.label(row.label),
            _enough(row),
            text.count(row.examples) if row.examples else "",
            text.duration(row.seconds),
            text.percent(row.recall),
            text.percent(row.precision),
            "" if row.label == "null" else text.percent(row.event_recall),
            _answered(found.gesture, number),
            charts.examples_curve(row.curve),
        )
        for number, row in enumerate(found.classes)
    ]
    below = text.paragraph(
        "<small>Windows found: share of its windows that are named so. Precise: share of those so "
        "named that are it. Gestures found: share of whole gestures, by their mean probability. "
        "Answered: how many of them the device would answer rightly, with the thresholds that "
        "training sets. All in sessions held out. With more: the share of gestures missed, after a "
        "short training on a quarter, a half, and all of the examples; where it still falls, more "
        "examples would help.</small>"
    )
    return text.section("Gesture by gesture", text.table(head, rows, text=2), below)


def _enough(row: ClassRow) -> str:
    if row.label == "null":
        return ""
    if row.more:
        return f'<span class="chip doubtful">{row.more} more</span>'
    kind = "good" if row.advice.startswith("enough") else "doubtful"
    name = "make it clearer" if kind == "doubtful" else "enough"
    return f'<span class="chip {kind}">{name}</span>'


def _answered(gesture: GestureResult, number: int) -> str:
    """Return how many of a gesture are answered rightly: "13 of 20"."""
    if not number or not gesture.answered:
        return ""
    row = gesture.answered[number]
    return f"{text.count(row[number])} of {text.count(sum(row))}"


def confusion(found: Training) -> str:
    """Return what was taken for what."""
    if (gesture := found.gesture) is None:
        return ""
    parts = []
    if any(map(any, gesture.event_confusion)):
        matrix = [row[1:] for row in gesture.event_confusion[1:]]
        parts.append("<h3>Whole gestures</h3>" + text.matrix(found.labels[1:], matrix))
    parts.append("<h3>Single windows</h3>" + text.matrix(found.labels, gesture.confusion))
    said = text.paragraph(
        "Rows are what was done, columns what it was taken for, in sessions held out. "
        + _worst(found)
    )
    return text.section("What is taken for what", said, text.beside(*parts, even=False))


def _worst(found: Training) -> str:
    """Return the pair of gestures that is confused most, in words."""
    assert found.gesture is not None
    table, names = found.gesture.event_confusion, found.labels
    pairs = [
        (table[i][j] + table[j][i], sum(table[i]) + sum(table[j]), names[i], names[j])
        for i in range(1, len(names))
        for j in range(i + 1, len(names))
    ]
    swapped, both, one, other = max(pairs, default=(0, 0, "", ""))
    if not swapped:
        return "No gesture was taken for another."
    return (
        f"Most often confused: {text.label(one)} and {text.label(other)}, in "
        f"{swapped} of {both} events."
    )


def labels(found: Training) -> str:
    """Return how late labels were, and what was done about it."""
    late = [row.lateness for row in found.sessions if row.lateness is not None]
    if not late:
        return ""
    middle = sorted(of.begin_s for of in late if math.isfinite(of.begin_s))
    masked, moved = sum(of.masked for of in late), sum(of.moved for of in late)
    edges = sum(of.edges for of in late)
    usual = text.late(middle[len(middle) // 2] if middle else math.nan)
    done = (
        f"Of {text.several(edges, 'label')}, {text.count(moved)} were moved to where the sensor "
        f"felt the touch; {text.several(masked, 'frame')} too close to an edge to be told apart "
        "are not learned from."
        if found.recipe == "default"
        else "The paper learns from labels as they were given, and so does its recipe."
    )
    said = f"A label begins {usual} its touch (median of the sessions). {done}"
    wrong = [(of.wrong, of.wrong_after) for of in late if math.isfinite(of.wrong)]
    known = ""
    if wrong:
        before, after = (sum(one) / len(wrong) for one in zip(*wrong, strict=True))
        known = (
            f"The simulator knows the truth: {text.percent(before)} of the frames were labelled "
            f"wrongly; after the repair {text.percent(after)} would be."
        )
    lost = sum(of.unfelt for of in late), sum(of.unlabelled for of in late)
    extra = (
        f"{text.several(lost[0], 'label')} had no touch under "
        f"{'it' if lost[0] == 1 else 'them'}, {text.several(lost[1], 'touch', 'touches')} had "
        "no label (a brush and a resting hand should have none)."
    )
    caption = (
        '<span class="key unseen">Beginnings</span> and <span class="key random">ends</span> of '
        "labels: the median, and the range of the middle half. The upright strokes are the truth, "
        "where a simulation knows it."
    )
    return text.section(
        "How late labels were",
        text.paragraph(said, known, extra),
        text.figure(charts.lateness(found.sessions), caption),
    )


def calibration(found: Training) -> str:
    """Return how much a probability means."""
    if found.gesture is None or not found.gesture.calibration.bins:
        return ""
    made = found.gesture.calibration
    said = (
        f"A probability is off by {text.percent(made.error_after)} on average (expected "
        f"calibration error). As trained it was {text.percent(made.error)}; everything was "
        f"divided by a temperature of {made.temperature:.2f}, which is inside the bundle."
        if made.temperature != 1.0
        else f"A probability is off by {text.percent(made.error_after)} on average (expected "
        "calibration error). Nothing was corrected."
    )
    drawn = text.figure(
        charts.reliability(made.bins), "On the diagonal, “90 % sure” is right nine times in ten."
    )
    return text.section("How much a probability means", text.paragraph(said), drawn)


def places(found: Training, judged: Evaluation | None) -> str:
    """Return where errors of places are."""
    if (result := found.location) is None or not result.touches or _placed(judged):
        return ""
    sites = (
        f"Touches within a quarter pitch of a taxel are {text.number(result.on_site)} grid units "
        f"off, all others {text.number(result.off_site)}. The paper’s touches were on the taxels "
        "only."
    )
    return text.section(
        "Where a touch is",
        text.paragraph(sites),
        text.place_maps(
            maps.errors(result.touches, found.rows, found.columns),
            maps.error_map(result.touches, found.rows, found.columns),
        ),
    )


def _placed(judged: Evaluation | None) -> bool:
    return judged is not None and any(result.location for result in judged.results)
