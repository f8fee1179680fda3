"""Record of a demo: what the hand truly did, what was understood, and how the two agree."""

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from controller.shared.event_metric import Answer, Event, Score, judge
from controller.shared.protocol.messages import Command, GroundTruth
from host.connection.receiver import Delivered, Received
from tetris.engine.events import Event as GameEvent
from tetris.engine.events import Locked


@dataclass(slots=True)
class DemoRecord:
    """Record of a demo: the hand's truth, the commands, the game."""

    meant: dict[int, str] = field(default_factory=dict)
    truths: list[GroundTruth] = field(default_factory=list)
    commands: list[tuple[int, str]] = field(default_factory=list)  # (ms of the action, name)
    pieces: int = 0
    lines: int = 0

    def take(self, received: list[Received], until_ms: int) -> None:
        """Note truths and commands of one tick."""
        for item in received:
            if isinstance(item, Delivered) and isinstance(item.message, GroundTruth):
                self.truths.append(item.message)
            elif isinstance(item, Delivered) and isinstance(item.message, Command):
                self.commands.append((until_ms, item.message.name))

    def watch(self, events: list[GameEvent]) -> None:
        """Note what the game did."""
        for event in events:
            if isinstance(event, Locked):
                self.pieces += 1
                self.lines += len(event.rows)

    @property
    def _gestures(self) -> list[GroundTruth]:
        """The performances that mean something; the others are stray touches."""
        return [truth for truth in self.truths if self.meant[truth.number]]

    @property
    def _events(self) -> list[Event]:
        return [
            Event(truth.onset_ms / 1000, truth.release_ms / 1000, self.meant[truth.number])
            for truth in self._gestures
        ]

    def score(self) -> Score:
        """Judge each performed gesture by the command that it meant."""
        return judge(self._events, [Answer(ms / 1000, name) for ms, name in self.commands])

    def verdict(
        self, seed: int, seconds: float, received: int = 0, sent: int = 0
    ) -> dict[str, Any]:
        """Return the figures of a demo, and bytes over the link: each performed gesture judged."""
        gestures, events, score = self._gestures, self._events, self.score()
        return {
            "seed": seed,
            "seconds": seconds,
            "intended": score.intended,
            "hits": score.hits,
            "wrong": score.wrong,
            "missed": score.missed,
            "false_alarms": score.false_alarms,
            "duplicates": score.duplicates,
            "latency_s": {
                "p50": _quantile(score.latencies_s, 0.5),
                "p95": _quantile(score.latencies_s, 0.95),
            },
            "pieces": self.pieces,
            "lines": self.lines,
            "by_command": dict(sorted(Counter(event.kind for event in events).items())),
            "stray_touches": len(self.truths) - len(gestures),
            "link_bytes": {"received": received, "sent": sent},
            "commands": self.commands,
            "events": [[one.onset_ms, one.release_ms, self.meant[one.number]] for one in gestures],
        }


def _quantile(values: list[float], share: float) -> float | None:
    """Return the smallest value that `share` of the values do not exceed; None of none."""
    if not values:
        return None
    return round(sorted(values)[max(0, math.ceil(share * len(values)) - 1)], 4)
