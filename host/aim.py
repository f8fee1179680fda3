"""Aim: a finger's place on the dome is the column of the piece, pressing deeper drops it.

Contacts and the game come in, actions of the game go out; there is no clock. A touch steers in each
frame that may show one finger; if most showed several rather, that is taken back when it lifts.
Once it has settled, slides are fine: two columns for five of the dome, as the skin goes along with
a finger; but beyond the taxels is the edge. Depth that rises quickly by `DROP_MM` drops the piece;
the column is then the one from before the rise.
"""

import math
from collections import deque
from collections.abc import Collection
from typing import Final

from controller.shared.protocol.messages import ContactState
from tetris.engine.game import Action, Game

SETTLE_S: Final = 0.15  # after which a touch may have settled
SETTLED_MM: Final = 1.0  # its two halves differ by less, or it rises by less
BEGIN_MM: Final = 0.9  # of a rise or a fall: the column is frozen
DROP_MM: Final = 1.1  # of a rise: the piece drops
SIGMAS: Final = 1.2  # a rise of so many of its deviations is no noise
BEFORE_S: Final = 0.1  # the frozen column is so much older: a finger shifts as it presses
LEAVING: Final = 0.7  # of its depth, below which a touch steers no more
FALLEN, AGAIN = 0.3, 1.3  # shares of its depth, and of the least since: the finger came back
SEVERAL_PROBABILITY: Final = 0.75  # of several fingers, from which they neither steer nor drop
ONE_FRAMES: Final = 6  # that show one, until it makes no gesture of several
MEAN_FRAMES: Final = 4  # that a rise is averaged over
HYSTERESIS: Final = 0.15  # of a column, beyond its edge
UNSURE: Final = 0.6  # and more: columns for each grid unit of the place's deviation
FINE: Final = ((5.0, 2.0), (7.5, 7.5))  # finger's way, piece's way, in columns; equal beyond
RESTING: Final = 0.05  # grid units in half of `SETTLE_S`: a slide is over
SLIDE_DISTANCE: Final = 0.2  # and from its first half: a rise is no press, as the rim feels less
EDGE_DISTANCE: Final = 0.3  # grid units beyond the outer taxels: the piece is at the edge
BEYOND_FRAMES: Final = 3  # in a row that show it there: the end of a slide may look farther out
EDGE_FRAMES: Final = 4  # that a rise lasts soon after: a slide from the rim is seen late
RIM_DISTANCE: Final = 0.5  # from the outer taxels: slides are no longer than to here
LIGHTEST_MM: Final = 1.5  # of a touch; a single frame at rest may show less
GAP_S, ECHO_MM = 0.1, 4.0  # after a touch, and depth, of what a recovering sensor still shows
LATE_S: Final = 0.5  # a gesture is recognised so late after its touch; it repeats no drop
_TINY_S: Final = 1e-6


class Aim:
    """Steers pieces by touches; the same for the same touches and game."""

    def __init__(self, rows: int = 5, columns: int = 5) -> None:
        """Aim on a dome of so many taxels."""
        self._up, self._across = rows - 1, columns - 1
        self._dropped_s = self._lifted_s = -math.inf
        self._from: tuple[object, int] = (None, 0)
        self._end()

    def _end(self) -> None:
        self._landed = self._active = self._upper = False
        self._steers = True  # before its depth has settled, too
        self._several = 0  # frames that show several fingers, less those with one
        self._one = 0  # frames in a row with one finger
        self._rest(-math.inf)

    def _rest(self, now_s: float) -> None:
        """Forget depth and place, as of a new touch."""
        self._since_s, self._settled = now_s, False
        self._landing_mm = 0.0  # what the landing leaves of the rise
        self._rising = 0  # frames in a row of a rise that drops
        self._deepest_mm = self._least_mm = 0.0  # and the least since the deepest
        self._anchor: tuple[float, float] | None = None  # x, and the piece's middle there
        self._goal: tuple[int, int] | None = None  # width and left column of the piece
        self._recent: deque[tuple[float, ContactState]] = deque()
        self._past: deque[tuple[float, float, tuple[int, int]]] = deque()  # time, depth, goal

    def again(self) -> "Aim":
        """Return one that nothing has touched yet, on the same dome."""
        return Aim(self._up + 1, self._across + 1)

    @property
    def touching(self) -> bool:
        """Whether a touch, mostly of one finger, steers now or is frozen to drop."""
        return self._active and self._several <= 0

    # -- what comes in -----------------------------------------------------------------

    def touch(self, touch: ContactState, now_s: float, game: Game) -> list[Action]:
        """Take the contact of a frame, or that it has ended; return what it does in the game."""
        if not touch.fingers:
            return self._lift(now_s, game)
        lifted = self._lift(now_s, game) if self._back_again(touch) else []
        lightest_mm = ECHO_MM if now_s < self._lifted_s + GAP_S else LIGHTEST_MM
        if not self._landed and touch.depth_mm < lightest_mm:
            return lifted
        if not self._landed:
            self._end()
            self._landed = self._active = True
            self._since_s, self._from = now_s, (_number(game), _span(game)[0])
        self._several += -1 if touch.fingers == 1 else 1
        self._one = self._one + 1 if touch.fingers == 1 else 0
        if self._one >= ONE_FRAMES:
            self._from = (_number(game), _span(game)[0])
        done = self._move(touch, now_s, game)
        return [*lifted, *done] if _may_be_one(touch) or Action.HOLD in done else lifted

    def _move(self, touch: ContactState, now_s: float, game: Game) -> list[Action]:
        """Take a contact of one finger; return what it does in the game."""
        self._recent.append((now_s, touch))
        while len(self._recent) > 2 and self._recent[0][0] < now_s - SETTLE_S:
            self._recent.popleft()
        rise_mm = _mean(list(self._recent)[-MEAN_FRAMES:], "rise_mm")
        if not self._settled and self._active:
            self._upper = self._steers and self.touching and _mean(self._recent, "y") > self._up
            if now_s >= self._since_s + SETTLE_S - _TINY_S and self._still(rise_mm):
                if self._upper:
                    self._spend()
                    return [Action.HOLD]
                self._settle(game)
                self._landing_mm = rise_mm
        self._landing_mm = max(0.0, min(self._landing_mm, rise_mm))
        rise_mm -= self._landing_mm
        return self._steer(touch, rise_mm, now_s, game) if self._active and not self._upper else []

    def _lift(self, now_s: float, game: Game) -> list[Action]:
        if not self._landed:
            return []
        done = [Action.HOLD] if self._upper else []
        if self._active and self._several > 0:
            done = self._back(game)
        self._lifted_s, self._landed, self._active = now_s, False, False
        return done

    def _back_again(self, touch: ContactState) -> bool:
        """Whether the finger has left and come back, too soon for the sensor to be at rest."""
        if touch.depth_mm >= self._deepest_mm:
            self._deepest_mm = self._least_mm = touch.depth_mm
        self._least_mm = min(self._least_mm, touch.depth_mm)
        fallen = self._least_mm < FALLEN * self._deepest_mm
        return self._landed and fallen and touch.depth_mm > AGAIN * self._least_mm

    def command(self, action: Action, located: bool, now_s: float, game: Game) -> list[Action]:
        """Take a recognised gesture; return what it does, () of one that the place decides.

        A gesture of several fingers may have steered as one finger: that is taken back. What has
        been one finger for `ONE_FRAMES` makes none: it slides.
        """
        one = self._landed and self._one >= ONE_FRAMES
        if located or one or (action is Action.HARD_DROP and now_s < self._dropped_s + LATE_S):
            return []
        recent = self._landed or now_s < self._lifted_s + LATE_S
        self._spend()
        return [*(self._back(game) if recent else ()), action]

    # -- what it does ------------------------------------------------------------------

    def _spend(self) -> None:
        """Let the touch do nothing more until it has lifted."""
        self._active = self._upper = False

    def _still(self, rise_mm: float) -> bool:
        """Whether the depth does not rise or is as just before; both, once the touch dropped."""
        either = min if self._steers else max
        return len(self._recent) > 1 and either(abs(rise_mm), self._change("depth_mm")) < SETTLED_MM

    def _beyond(self) -> list[bool]:
        """Return of each recent frame whether the finger is beyond the outer taxels."""
        far = self._across + EDGE_DISTANCE
        return [not -EDGE_DISTANCE < touch.x < far for _, touch in self._recent]

    def _slides(self, touch: ContactState) -> bool:
        """Whether the finger is elsewhere than just before."""
        before = list(self._recent)[: len(self._recent) // 2]
        away = touch.x - _mean(before, "x"), touch.y - _mean(before, "y")
        return math.hypot(*away) > SLIDE_DISTANCE + touch.place_sigma / 2

    def _change(self, name: str) -> float:
        """Return by how much an attribute's mean differs between the halves of `SETTLE_S`."""
        seen, half = list(self._recent), len(self._recent) // 2
        return abs(_mean(seen[half:], name) - _mean(seen[:half], name))

    def _settle(self, game: Game) -> None:
        self._settled = self._steers = True
        x, scale = _mean(self._recent, "x"), game.config.columns / self._across
        width, left = self._aim(x * scale, self._recent[-1][1], game)
        self._anchor = x, left + width / 2

    def _steer(self, touch: ContactState, rise_mm: float, now_s: float, game: Game) -> list[Action]:
        noise_mm = SIGMAS * touch.rise_sigma / math.sqrt(MEAN_FRAMES)
        deeper = self._settled and _may_be_one(touch) and rise_mm >= max(DROP_MM, noise_mm)
        slides = self._settled and self._slides(touch)
        self._rising = self._rising + 1 if deeper and not slides else 0
        if self._rising >= (EDGE_FRAMES if any(self._beyond()) else 1):
            steps = self._go(game)
            self._dropped_s, self._steers = now_s, False
            self._rest(now_s)
            return [*steps, Action.HARD_DROP]
        leaving_mm = LEAVING * self._deepest_mm
        pressed = self._settled and not slides
        if abs(rise_mm) >= max(BEGIN_MM, noise_mm) and (pressed or rise_mm < 0.0):
            if self._past:
                self._goal = self._past[0][2]
        elif self._steers:
            goal = self._aim(self._middle(touch, game), touch, game)
            self._past.append((now_s, touch.depth_mm, goal))
            while len(self._past) > 1 and (
                self._past[0][0] < now_s - BEFORE_S or self._past[0][1] < leaving_mm
            ):
                self._past.popleft()
            if self._anchor is not None:
                middle = goal[1] + goal[0] / 2
                rests = self._change("x") < RESTING + touch.place_sigma / 2
                if self._anchor[1] != middle and rests:
                    self._anchor = _mean(self._recent, "x"), middle
        return self._go(game)

    def _middle(self, touch: ContactState, game: Game) -> float:
        """Return where the piece's middle is to be, in columns."""
        scale = game.config.columns / self._across
        if self._anchor is None or all(self._beyond()[-BEYOND_FRAMES:]):
            return touch.x * scale
        x, middle = self._anchor
        return middle + _fine((self._on_dome(touch.x) - self._on_dome(x)) * scale)

    def _on_dome(self, x: float) -> float:
        """Return a place, or the nearest one within the rim."""
        return max(-RIM_DISTANCE, min(self._across + RIM_DISTANCE, x))

    def _aim(self, middle: float, touch: ContactState, game: Game) -> tuple[int, int]:
        """Choose the piece's width and left column for its middle, in columns."""
        width, hysteresis = _span(game)[1], HYSTERESIS + UNSURE * touch.place_sigma
        if (
            self._goal is None
            or self._goal[0] != width
            or abs(middle - self._goal[1] - width / 2) > 0.5 + hysteresis
        ):
            left = math.floor(middle - width / 2 + 0.5)
            self._goal = width, max(0, min(game.config.columns - width, left))
        return self._goal

    def _go(self, game: Game) -> list[Action]:
        return steps(game, self._goal[1]) if self._goal else []

    def _back(self, game: Game) -> list[Action]:
        """Return the steps to where the piece was when the touch landed, or last was one finger."""
        number, left = self._from
        return steps(game, left) if number == _number(game) else []


def steps(game: Game, left: int) -> list[Action]:
    """Return the steps that bring the piece's left cell to a column, as far as it is free."""
    found: list[Action] = []
    if not game.in_play:
        return found
    piece, away = game.piece, left - _span(game)[0]
    for _ in range(abs(away)):
        piece = piece.right if away > 0 else piece.left
        if game.board.bits & piece.mask:
            break
        found.append(Action.RIGHT if away > 0 else Action.LEFT)
    return found


def _span(game: Game) -> tuple[int, int]:
    """Return the left column and the width of the piece in play."""
    columns = [x for x, _ in game.piece.cells]
    return min(columns), max(columns) - min(columns) + 1


def _number(game: Game) -> object:
    """Return what tells the piece in play from others of the game."""
    return game.pieces_placed, game.piece.kind


def _may_be_one(touch: ContactState) -> bool:
    return touch.fingers == 1 or touch.fingers_sure < SEVERAL_PROBABILITY


def _mean(seen: Collection[tuple[float, ContactState]], name: str) -> float:
    """Return the mean of an attribute."""
    return float(sum(getattr(touch, name) for _, touch in seen) / len(seen))


def _fine(way: float) -> float:
    """Return a piece's way for a finger's way from where it settled, both in columns."""
    (near, slow), (far, _) = FINE
    long = abs(way)
    if long <= near:
        long *= slow / near
    elif long < far:
        long = slow + (long - near) * (far - slow) / (far - near)
    return math.copysign(long, way)
