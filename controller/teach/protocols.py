"""Protocols of teaching sessions: examples of every gesture, or of one at every place; pure."""

from typing import Final

import numpy as np

from controller.bundles.vocabulary import Vocabulary
from controller.capture.cues import MAX_EXAMPLES, NULL_LABEL, CueTiming, ExampleRequest
from controller.teach import TeachError

GESTURES: Final = "gestures"  # every gesture, and touches that are none, in any order
LOCATIONS: Final = "locations"  # gestures whose place counts, on every site and between them
USERS: Final = "users"  # as gestures, one person after the other
FEW: Final = "few"  # some examples of one gesture, to be learned at once: `controller teach --add`
# Examples of each gesture, or of each place.
REPETITIONS: Final = {GESTURES: 10, LOCATIONS: 2, USERS: 10}
MOST_SITES: Final = 100  # of a session; of a larger grid so many are drawn
NOTHING: Final = "touch it, but make none of the gestures"  # what the cue says of "null"

# Whoever knows what comes next needs little time to get ready, and in play gestures follow each
# other quickly: a network that only ever saw them alone misses them there. A place is found more
# slowly than it is pressed.
_BRISK: Final = CueTiming(get_ready_s=0.5, go_s=2.5, rest_s=0.4, jitter_s=1.6, still_s=0.4)
PACES: Final = {
    GESTURES: _BRISK,
    LOCATIONS: CueTiming(get_ready_s=1.2, go_s=2.0, rest_s=0.5, jitter_s=0.5, still_s=0.4),
    USERS: _BRISK,
    # Whoever teaches from so few shall do each with care, and what was before it is learned too.
    FEW: CueTiming(get_ready_s=1.5, go_s=3.0, rest_s=1.0, jitter_s=0.5, still_s=0.6),
}

Place = tuple[float, float]


def asks(
    protocol: str,
    vocabulary: Vocabulary,
    grid: tuple[int, int],
    repetitions: int,
    rng: np.random.Generator,
) -> list[ExampleRequest]:
    """Return the examples of a session, in an order that `rng` draws.

    `repetitions` counts examples of each gesture, or of each place on a `grid` = (rows, columns).

    Raises:
        TeachError: No gesture has a place, or there are too many examples.
    """
    if protocol == LOCATIONS:
        if not vocabulary.located:
            raise TeachError(
                f"no gesture of {vocabulary.name!r} has a place; write located = true to one"
            )
        places = sites(*grid, rng)
        once = [ExampleRequest(label, place) for label in vocabulary.located for place in places]
    elif protocol == FEW:
        once = [ExampleRequest(label) for label in vocabulary.labels[1:]]
    else:
        once = [ExampleRequest(label) for label in (*vocabulary.labels[1:], NULL_LABEL)]
    if len(once) * repetitions > MAX_EXAMPLES:
        raise TeachError(
            f"{len(once) * repetitions} examples are more than {MAX_EXAMPLES}; "
            "choose fewer --repetitions"
        )
    # In rounds: after an early stop each has been asked for as often.
    return [once[i] for _ in range(repetitions) for i in rng.permutation(len(once))]


def sites(rows: int, columns: int, rng: np.random.Generator) -> list[Place]:
    """Return where to touch, grid units: on taxels and between four; at most `MOST_SITES`."""
    places = [(float(x), float(y)) for y in range(rows) for x in range(columns)]
    places += [(x + 0.5, y + 0.5) for y in range(rows - 1) for x in range(columns - 1)]
    most = min(len(places), MOST_SITES)
    return [places[i] for i in sorted(rng.choice(len(places), most, replace=False))]
