"""Content of a report: results of a training, a tuning and an evaluation, any of them."""

from dataclasses import dataclass

from models.results.evaluation import Evaluation, Tuning
from models.results.training import Training


@dataclass(frozen=True, slots=True)
class ReportData:
    """All that one page is about.

    Attributes:
        training: What a training found out; None: nothing was trained.
        tuning: What `models tune` found out; None: the thresholds were not chosen anew.
        evaluation: What `models evaluate` found out; None: nothing was judged.
    """

    training: Training | None = None
    tuning: Tuning | None = None
    evaluation: Evaluation | None = None

    @property
    def name(self) -> str:
        """File name of the bundle that this is about."""
        if self.training is not None:
            return self.training.name
        if self.tuning is not None:
            return self.tuning.bundle
        return self.evaluation.bundle if self.evaluation is not None else ""
