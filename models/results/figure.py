"""A figure with its interval of confidence."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure and its 95 % interval; the bounds are NaN where there is but one session."""

    value: float  # the figure over all sessions
    low: float  # lower bound
    high: float  # upper bound

    def __str__(self) -> str:
        """Return it for a table, such as "0.9977 (0.9961–0.9989)"."""
        if math.isnan(self.low):
            return f"{self.value:.4f}"
        return f"{self.value:.4f} ({self.low:.4f}–{self.high:.4f})"
