"""Recording of a whole game of a bot."""

from tetris.bots.registry import Planner
from tetris.engine.events import Event
from tetris.engine.game import Phase
from tetris.engine.pieces import Piece
from tetris.history.replay import Recorder


def play(
    recorder: Recorder, planner: Planner, *, pieces: int, action_s: float = 0.0
) -> list[Event]:
    """Let a bot play until the game is over or so many pieces are placed; return the events.

    Args:
        recorder: A running game; its clock goes on from `recorder.time_s`.
        planner: The bot.
        pieces: Placed in the whole game.
        action_s: How long each action takes; the bot looks at the board after each. 0 is as
            fast as the rules allow.
    """
    game, config = recorder.game, recorder.game.config
    wait_s = config.generation_delay_s + config.guard_s  # in which nothing or no drop is taken
    now_s = recorder.time_s
    events = recorder.update(now_s)
    target: Piece | None = None
    placed = game.pieces_placed
    while game.phase is Phase.RUNNING and game.pieces_placed < pieces:
        if game.pieces_placed != placed or not game.in_play:
            placed, target = game.pieces_placed, None
            if wait_s:
                now_s += wait_s
                events += recorder.update(now_s)
                continue
        plan = planner(game, target=target)
        target = plan.landing
        actions = plan.actions[:1] if action_s else plan.actions
        now_s += action_s
        events += recorder.update(now_s, actions)
    return events
