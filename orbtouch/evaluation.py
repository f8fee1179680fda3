"""Judging of any predictor of windows by its events, through the device's debouncer."""

import copy
import itertools
import logging
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from controller.recognition.debounce import DebounceSettings
from controller.recognition.images.frames import PreprocessSettings, same_rate
from controller.recordings.quality.check import FrameIndex
from controller.shared.errors import UserError, count
from models.data import load
from models.data.ground_truth import GroundTruth
from models.data.splits import HoldOut
from models.evaluation import tune
from models.evaluation.event_counts import tally
from models.evaluation.replay import Stream, debounced_stream, network_inputs
from orbtouch import checks, windows
from orbtouch.networks import Base, Network, network_of
from orbtouch.onnx_files import null_first
from orbtouch.recordings import Given, Recording, several
from orbtouch.results import Evaluation, evaluation_of

LEARNED: Final = 20_000  # windows that an estimator is given at most, evenly spread
AT_ONCE: Final = 2_000  # windows that are predicted in one call
SUM: Final = 1e-3  # greatest error of a sum of probabilities

Predict = Callable[[NDArray[np.float32]], ArrayLike]
_Answers = tuple[NDArray[np.int64], Predict]  # numbers of the classes of its columns

log = logging.getLogger("orbtouch")


class _FewError(UserError):
    """There are too few recordings."""


@checks.sentences()
def evaluate(
    predict: Network | Predict | Any,
    recordings: Given | Iterable[Given],
    *,
    classes: Sequence[str] = (),
    window: int = 0,
    by: Literal["user", "session", ""] = "",
    folds: int = 5,
    debounce: Base = None,
) -> Evaluation:
    """Return how a predictor answers labelled recordings, by the device's stages and event metric.

    Args:
        predict: A network, or a callable that returns probabilities, (n, classes), for windows,
            (n, window, rows, columns), as of `Recording.windows`; or an estimator with `fit(X, y)`
            and `predict_proba(X)`, of which a copy learns from all recordings but those it is
            judged on, at most 20,000 windows.
        recordings: Of one sensor and rate; paths are loaded.
        classes: Names of a callable's columns, in their order, "null" among them; (): those of the
            recordings, "null" first, which `y` counts, too.
        window: Images in a window; 0: those of a second.
        by: What an estimator's folds hold out as a whole: "user" or "session"; "": users if there
            are two or more.
        folds: Number of folds, 2 or more; no more than there are users or sessions.
        debounce: Network, or its file, whose debouncer's settings are used; None: those of an
            estimator are chosen on a third of whom it learns from, a callable has the default ones.

    Raises:
        Error: An argument is unfit, the recordings cannot be split without a leak, or the
            predictor raises or returns no probabilities.
    """
    given = several(recordings)
    if isinstance(predict, Network):
        return predict.evaluate(given)
    learns = hasattr(predict, "fit") and hasattr(predict, "predict_proba")
    if isinstance(predict, type) or not (learns or callable(predict)):
        raise UserError(
            f"{type(predict).__name__} cannot be judged; give a network, a callable that returns "
            "probabilities, or an estimator with fit and predict_proba"
        )
    checks.window(window)
    checks.whole(folds, "folds", 2, 1000)
    checks.one_of(by, "by", ("", "user", "session"))
    for one in given[1:]:
        kinds = {(r.frames.shape[1:], r.unit, r._source.origin.sign) for r in (given[0], one)}
        if len(kinds) > 1 or not same_rate(given[0].rate_hz, one.rate_hz, load.RATES):
            raise UserError(f"{given[0]!r} and {one!r} are not of one sensor and rate; part them")
    columns = tuple(classes) or tuple(dict.fromkeys(name for one in given for name in one.classes))
    names = [columns[place] for place in null_first(columns)]
    if odd := {name for one in given for name in one.labels.tolist()} - {"", *names}:
        raise UserError(f"a recording has the gesture {min(odd)!r}, which classes lack; add it")
    thresholds: DebounceSettings | None = None
    if debounce is not None:
        thresholds = network_of(debounce, "debounce")._bundle.debounce.for_labels(names)
    tallies = {}
    for held in _folds(given, by, folds) if learns else [np.ones(len(given), dtype=np.bool_)]:
        learned = [one for one, out in zip(given, held, strict=True) if out != learns]
        settings = windows.settings_of([one._source for one in learned], window)
        stages, chosen = _Stages(settings, names), thresholds
        answers: _Answers = np.array([names.index(name) for name in columns]), predict
        if learns:
            chosen = chosen or stages.thresholds(predict, learned)
            answers = stages.fitted(predict, learned)
        for number in np.flatnonzero(held).tolist():
            counts = tally(stages.stream(answers, given[number], chosen), names)
            said = count(counts.events, "gesture")
            log.info("%s: %d of %s", given[number].name, counts.hits, said)
            tallies[number] = counts
    return evaluation_of(names, [tallies[number] for number in range(len(given))])


@dataclass(frozen=True, slots=True)
class _Stages:
    """The device's stages, of images of one kind and for classes by name."""

    settings: PreprocessSettings
    names: list[str]

    def thresholds(self, estimator: Any, learned: Sequence[Recording]) -> DebounceSettings | None:
        """Return when a gesture counts, chosen on a third of the people, or sessions, learned from.

        A copy that has not learned from these answers them. None if there is but one, or no
        gesture.
        """
        try:
            held = _folds(learned, "", 3)[0]
            answers = self.fitted(estimator, [*itertools.compress(learned, ~held)])
            streams = [self.stream(answers, one) for one in itertools.compress(learned, held)]
            return tune.tune(self.names, DebounceSettings(), streams).chosen.settings
        except (_FewError, ValueError):
            return None

    def stream(
        self, answers: _Answers, one: Recording, debounce: DebounceSettings | None = None
    ) -> Stream:
        """Return what the device makes of a recording by probabilities of the classes known."""
        source, (known, predict) = one._cut(), answers
        truth = GroundTruth.of(source, self.names, one.name)
        inputs = network_inputs(source.frames, self.settings)
        outputs = np.zeros((len(inputs.windows), len(self.names)), dtype=np.float32)
        columns = [self.names[i] for i in known]
        for first in range(0, len(outputs), AT_ONCE):
            some = slice(first, first + AT_ONCE)
            outputs[some, known] = checked(predict, inputs.windows[some], columns)
        return debounced_stream(truth, inputs, outputs, self.names, debounce or DebounceSettings())

    def fitted(self, estimator: Any, taught: Sequence[Recording]) -> _Answers:
        """Return what a copy of an estimator that has learned recordings answers."""
        every = -(-sum(map(len, taught)) // LEARNED)
        facts = self.settings, self.names
        cut = [windows.cut(one._source, one.name, *facts, one._span, every) for one in taught]
        y = np.concatenate([one.y for one in cut])
        if len(known := np.unique(y)) < 2:
            raise _FewError("a fold has windows of fewer than two classes; give more recordings")
        try:
            own = copy.deepcopy(estimator)
            own.fit(np.concatenate([one.X for one in cut]), y)
        except Exception as error:
            said = f"{type(error).__name__} at {len(y)} windows: {error}"
            raise UserError(f"{type(estimator).__name__}.fit raised {said}") from error
        return known, own.predict_proba


def checked(
    predict: Predict, given: NDArray[np.float32], columns: Sequence[str]
) -> NDArray[np.float64]:
    """Return the probabilities, (n, columns), of windows; Error if they are none."""
    name = getattr(predict, "__qualname__", type(predict).__name__)
    try:
        answer = np.asarray(predict(given), dtype=np.float64)
    except Exception as error:
        said = f"{type(error).__name__} at windows {given.shape}: {error}"
        raise UserError(f"{name} raised {said}") from error
    expected = f"expected are probabilities of {', '.join(columns)}"
    if answer.shape != (len(given), len(columns)):
        wanted = (len(given), len(columns))
        raise UserError(f"{name} returned {answer.shape}, not {wanted}; {expected}, in order")
    fit = (answer >= 0.0).all(axis=1) & (np.abs(answer.sum(axis=1) - 1.0) <= SUM)  # NaN does not
    if not fit.all():
        odd = np.round(answer[fit.argmin()], 3).tolist()
        raise UserError(f"{name} returned {odd}; {expected}, which sum to 1")
    return answer


def _folds(given: Sequence[Recording], by: str, folds: int) -> list[NDArray[np.bool_]]:
    """Return which recordings each fold holds out, (recordings,); Error if that would leak."""
    copies = FrameIndex()
    for one in given:
        copies.add(one._source)
    user = [f"{one._source.origin.seed} {one.user}" for one in given]
    session = [f"{who} {one.session}" for who, one in zip(user, given, strict=True)]
    people, visits = (load.join(names, copies.shared()) for names in (user, session))
    users, sessions = len(np.unique(people)), len(np.unique(visits))
    chosen = by or ("user" if users > 1 else "session")
    if (many := users if chosen == "user" else sessions) < 2:
        raise _FewError(
            f"all recordings are of one {chosen}, so none can be held out without a leak; give "
            f"recordings of two or more, with their {chosen} named"
        )
    rule = HoldOut("session" if chosen == "session" else "user", folds=min(folds, many))
    return [rule.held(people, visits, fold) for fold in range(rule.folds)]
