"""The introduction: each gesture is shown on the dome, made by the player, and seen in a game."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from controller.shared.protocol.messages import COMMANDS, Command
from controller.shared.protocol.teaching import CommandRule, GestureInfo
from host.actions import ACTIONS
from host.app.screen import GamePage, Line, Orb
from host.ui import ghost, naming
from host.ui.pointer_input import DomeArea
from host.ui.zones import fits
from tetris.engine.game import Action, Config, Game, Phase
from tetris.kit.menu import Item, Menu
from tetris.kit.stage import ATTRACT_HZ, IDLE_HZ, Stage

_SEED: Final = 2  # its first five pieces are no O, which looks the same turned
_STILL: Final = Config(gravity=False, lock_resets=None)
_ON_S: Final = 1.6  # from a gesture that was right to the next step
_HINT_S: Final = 8.0  # without success, to a further hint
_INSTEAD_S: Final = 4.0  # for which it is said what was understood
_HUSH_S: Final = 0.6  # after the last step, in which the gesture may still be held

Exits = Callable[[], Sequence[Item]]
Point = tuple[float, float]  # grid units
Side = Literal["left", "right", "low", "high", "middle", "edge"]

_SHOWN: Final = COMMANDS[:-1]  # what a piece can show; a pause shows nothing
_MIRRORED: Final = {"twist_cw": "twist_ccw"}  # one of the two is enough
_OFF_CENTRE: Final = 0.6  # grid units; nearer to the middle a place has no side
_GRID: Final = 0.25  # grid units between the places that are tried
_HOLD_OFFSET: Final = 0.5  # grid units above the upper taxels: the middle of what holds a piece
_POINT_COMMAND: Final = "point"  # the command of a lesson of Aim that any step of the piece fulfils


@dataclass(frozen=True, slots=True)
class Step:
    """One gesture to make."""

    label: str
    command: str  # what it is for
    place: Point
    located: bool  # whether the gesture is for another command elsewhere
    say: str  # its name for people

    def side(self, pad: DomeArea) -> Side:
        """Return the part of the dome in which the place lies."""
        across, up = self.place[0] - pad.centre[0], self.place[1] - pad.centre[1]
        if self.place[1] > pad.rows - 1:
            return "edge"
        if max(abs(across), abs(up)) < _OFF_CENTRE:
            return "middle"
        if abs(up) > abs(across):
            return "high" if up > 0 else "low"
        return "right" if across > 0 else "left"


class LearnScreen(GamePage):
    """The steps, one after another; the game waits for the player.

    Attributes:
        steps: The gestures to make; empty until the orb is connected.
        number: The step that is shown; -1 asks whether to begin, `len(steps)` is the end.
    """

    def __init__(self, stage: Stage, orb: Orb, exits: Exits = tuple, *, ask: bool = False) -> None:
        """Show the first step, or `ask` before; `exits` are offered at the end."""
        self.steps: tuple[Step, ...] = ()
        self.number = -1 if ask else 0
        self._exits = exits
        self._made_of: tuple[list[GestureInfo], bool] = [], False  # and whether for Aim
        self._told: tuple[str, float] | None = None  # what was understood instead, and when
        self._right_s: float | None = None  # when the step's gesture was made
        self._since_s = stage.time_s  # when the step began
        super().__init__(stage, orb, Game(_SEED, _STILL))

    @property
    def step(self) -> Step | None:
        """The gesture to make now; None before the first and after the last."""
        return self.steps[self.number] if 0 <= self.number < len(self.steps) else None

    def page(self) -> Menu:
        """Return the items of the question, of a step or of the end."""
        if self.number < 0:
            items = [self.item("learn.begin", self._next), self.item("learn.later", self.leave)]
        elif self.step or not self.steps:
            items = [self.item("learn.next", self._next)] if self.steps else []
            items.append(self.item("learn.skip", self.leave))
        else:
            items = [*self._exits(), self.item("learn.menu", self.leave)]
        return Menu(self.words("learn.title"), items)

    @property
    def frames_hz(self) -> int:
        """Enough for the hand that shows a gesture; fewer where nothing moves."""
        return IDLE_HZ if self.step is None else ATTRACT_HZ

    # -- what the orb says ---------------------------------------------------------------

    def recognised(self, command: Command, time_s: float) -> bool:
        """Let the game do what was understood, and go on if it was the step's gesture."""
        step = self.step
        if step is None:
            return bool(self.steps) and self.number >= 0 and time_s < self._since_s + _HUSH_S
        right = (command.label, command.name) == (step.label, step.command)
        self._do(ACTIONS.get(command.name, Action.PAUSE), time_s, right=right)
        if self._right_s is None:
            self._told = self._instead(command, step), time_s
        return True

    def act(self, action: Action, time_s: float) -> None:
        """Take an action of Aim in a lesson; at the end, and to leave, it is the menu's."""
        step = self.step
        if step is None or action is Action.PAUSE:
            super().act(action, time_s)
        elif step.command == _POINT_COMMAND:
            self._do(action, time_s, right=action in (Action.LEFT, Action.RIGHT))
        else:
            self._do(action, time_s, right=action is ACTIONS[step.command])

    def _do(self, action: Action, time_s: float, *, right: bool) -> None:
        """Let the game do an action; one that is over begins again. `right`: the step's own."""
        if action is not Action.PAUSE:
            again = [Action.RESTART] if self.game.phase is Phase.OVER else []
            self.show(self.game.update(time_s, [*again, action]))
        self._right_s = time_s if right and self._right_s is None else self._right_s

    def _instead(self, command: Command, step: Step) -> str:
        """Return what was understood in place of a step's gesture."""
        words = self.words
        does = naming.command(words, command.name)
        if command.label == step.label:
            side = words(f"learn.side.{step.side(self.orb.state.pad)}")
            return words("learn.elsewhere", command=does, side=side)
        gesture = naming.gesture(words, command.label)
        return words("learn.instead", gesture=gesture, command=does)

    def _make_steps(self) -> None:
        """Take the gestures in use; while the orb is describing others, those from before."""
        state = self.orb.state
        infos = [state.gestures[label] for label in state.labels[1:] if label in state.gestures]
        made_of = infos, self.orb.aims
        if made_of == self._made_of or (self.steps and len(infos) < len(state.labels) - 1):
            return
        self._made_of = made_of
        made = (aim_steps if self.orb.aims else steps)(infos, state.pad)
        if made != self.steps:
            self.steps, self.number = made, min(self.number, 0)
            self._since_s = self._stage.time_s

    # -- time ----------------------------------------------------------------------------

    def tick(self, time_s: float) -> None:
        """Let the ghost move, and go on a moment after success."""
        self._make_steps()
        self.show(self.game.update(time_s))
        if self._right_s is not None and time_s >= self._right_s + _ON_S:
            self._next()
        step, shown_s = self.step, time_s - self._since_s
        self.orb.zones = step is not None and step.located
        self.orb.ghost = ()
        if step and not self.orb.state.contacts and self._right_s is None:
            pad = self.orb.state.pad
            self.orb.ghost = ghost.contacts(self._shown(step), step.place, shown_s, pad)
        super().tick(time_s)

    def _next(self) -> None:
        """Show the next step, or the end."""
        self.number += 1
        self._told = self._right_s = None
        self._since_s = self._stage.time_s
        self.selected = 0

    # -- what is seen --------------------------------------------------------------------

    def lines(self, time_s: float) -> list[Line]:
        """Return what to do, and how it went."""
        words, palette, step = self.words, self._stage.look.palette, self.step
        if step is not None:
            icon = "press" if step.command == _POINT_COMMAND else step.command
            return [
                Line(self._dots(), 22, palette.accent, after=8),
                Line(words(f"learn.does.{step.command}"), 40, palette.text, icon),
                Line(self._how(step), 27, palette.text, after=20),
                self._outcome(step, time_s),
            ]
        if self.number >= 0 and not self.steps:
            link = self.orb.state.link
            key = "learn.waiting" if link == "live" else f"orbs.link_{link}"
            return [Line(words(key), 27, palette.dim)]
        title, text = ("title", "ask") if self.number < 0 else ("end", "end_text")
        return [
            Line(words(f"learn.{title}"), 40, palette.text),
            Line(words(f"learn.{text}"), 27, palette.text, after=20),
        ]

    def _dots(self) -> str:
        passed = self.number + (self._right_s is not None)
        return " ".join("●" if number < passed else "○" for number in range(len(self.steps)))

    @property
    def _way(self) -> str:
        """What the dome is touched with: a hand, a touch screen's fingers or a mouse."""
        if not self.orb.virtual:
            return "hand"
        return "screen" if self.orb.by_fingers else "mouse"

    def _shown(self, step: Step) -> str:
        """Return the gesture that shows a step: fingers on a screen pinch to press deeper."""
        return "pinch" if step.label == "deeper" and self._way == "screen" else step.label

    def _how(self, step: Step) -> str:
        words = self.words
        if step.label not in ghost.STROKES:
            return words("learn.own", name=step.say)
        side = words(f"learn.side.{step.side(self.orb.state.pad)}")
        return words(f"learn.{self._way}.{self._shown(step)}", side=side)

    def _outcome(self, step: Step, time_s: float) -> Line:
        """Return what came of the last gesture, or how to make one."""
        words, palette = self.words, self._stage.look.palette
        if self.orb.state.link != "live":
            return Line(words("orb.lost"), 25, palette.warn)
        if self._right_s is not None:
            return Line(words(f"learn.did.{step.command}"), 30, palette.good)
        if self._told and time_s < self._told[1] + _INSTEAD_S:
            return Line(self._told[0], 25, palette.warn)
        if reason := self.orb.state.reason_unanswered(time_s):
            return Line(naming.unanswered(words, reason), 25, palette.warn)
        if time_s >= self._since_s + _HINT_S and step.label in ghost.STROKES:
            return Line(words(f"learn.more.{self._way}.{self._shown(step)}"), 25, palette.dim)
        return Line("", 25, palette.dim)


def steps(infos: Sequence[GestureInfo], pad: DomeArea) -> tuple[Step, ...]:
    """Return the steps for an orb with these gestures, in the order of their commands."""
    found = [
        Step(info.label, rule.command, place, len(info.rules) > 1, info.say)
        for info in infos
        for number, rule in enumerate(info.rules)
        if (place := _place(info.rules[:number], rule, pad)) is not None
    ]
    left_out = {_MIRRORED.get(step.label) for step in found}
    wanted = [step for step in found if step.command in _SHOWN and step.label not in left_out]
    return tuple(sorted(wanted, key=lambda step: _SHOWN.index(step.command)))


def aim_steps(infos: Sequence[GestureInfo], pad: DomeArea) -> tuple[Step, ...]:
    """Return the steps for Aim: touches first, and gestures that are the same everywhere."""
    if not infos:
        return ()
    middle, left = pad.centre, (0.0, pad.centre[1])
    others = [one for one in steps(infos, pad) if not one.located and one.command != "drop"]
    hold = Step("press", "hold", (middle[0], pad.rows - 1 + _HOLD_OFFSET), False, "")
    touch, deeper = (
        Step("touch", _POINT_COMMAND, left, False, ""),
        Step("deeper", "drop", left, False, ""),
    )
    return touch, *others, deeper, hold


def _place(before: Sequence[CommandRule], rule: CommandRule, pad: DomeArea) -> Point | None:
    """Return a place well inside a rule's region; None if the rules before it leave none."""
    edges = rule.left_of, rule.right_of, rule.below, rule.above
    if not before and all(map(math.isinf, edges)):
        return pad.centre
    points = [
        (column * _GRID, row * _GRID)
        for row in range(round((pad.rows - 1) / _GRID) + 1)
        for column in range(round((pad.columns - 1) / _GRID) + 1)
    ]
    inside = [p for p in points if fits(rule, *p) and not any(fits(one, *p) for one in before)]
    if not inside:
        return None
    middle = tuple(math.fsum(values) / len(inside) for values in zip(*inside, strict=True))
    return min(inside, key=lambda point: math.dist(point, middle))
