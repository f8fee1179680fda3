"""Training from recordings: a network in one call."""

from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from controller.shared.errors import UserError, how_to_install
from orbtouch.networks import Network, network


def train(
    paths: Path | str | Sequence[Path | str],
    out: Path | str,
    *,
    say: Callable[[str], None] = print,
    **options: Any,
) -> Network:
    """Train networks from recordings, write a bundle with its card and report, and return it.

    Args:
        paths: Recordings, or folders of them, of one sensor.
        out: Bundle to write, NAME.orb; interrupted, the same call goes on where it was.
        say: Takes lines of progress.
        options: As of `models train`, such as epochs=8, split="user" or seed=1 (docs/training.md).

    Raises:
        Error: The [train] extra is missing, or the recordings cannot be learned from.
    """
    if find_spec("torch") is None:
        raise UserError(f"training needs PyTorch; {how_to_install('train')}")
    from models.training.request import Request
    from models.training.train import train as run

    given = [paths] if isinstance(paths, str | Path) else paths
    known = set(Request.__dataclass_fields__) - {"paths", "out", "command"}
    if unknown := sorted(set(options) - known):
        raise UserError(f"there is no option {unknown[0]!r}; there are {', '.join(sorted(known))}")
    try:
        run(Request(tuple(map(Path, given)), Path(out), **options), say)
    except UserError:
        raise
    except ValueError as error:
        raise UserError(str(error)) from None
    return network(out)
