"""Checkpoints of interrupted trainings: plain arrays and JSON in one `.npz`, never pickled.

A checkpoint is taken after every epoch and holds the random generators too, so a resumed training
gives the same bytes as an uninterrupted one.
"""

import hashlib
import io
import json
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from controller.shared import files, npz
from controller.shared.errors import UserError, output_folder

MAX_BYTES: Final = 1 << 30
_WORDS: Final = "words"  # the JSON among the arrays
_MARK: Final = "training.npz"  # says which training a folder is of


class CheckpointError(UserError, ValueError):
    """A checkpoint is damaged or of another training; the message is one sentence."""


def save(path: Path, arrays: dict[str, NDArray[Any]], words: dict[str, Any]) -> None:
    """Write a checkpoint of arrays of any shape, complete or not at all."""
    whole = io.BytesIO()
    np.savez(whole, allow_pickle=False, **{_WORDS: np.array(json.dumps(words))}, **arrays)
    files.atomic_write(path, whole.getvalue())


def load(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]] | None:
    """Return a checkpoint's arrays and JSON values, None if there is none; or CheckpointError."""
    if not path.is_symlink() and not path.exists():
        return None
    try:
        arrays = npz.unpack(path, MAX_BYTES)
        words = json.loads(str(arrays.pop(_WORDS)))
        return arrays, dict(words)
    except (ValueError, KeyError, TypeError, RecursionError):
        raise damaged(path) from None


def damaged(path: Path) -> CheckpointError:
    """Return the error of a damaged checkpoint."""
    return CheckpointError(f"{path} is damaged; remove it, and training begins again")


def claim(folder: Path, of: object) -> None:
    """Make a folder for the checkpoints of a training, or check that it has them.

    The representation of `of` identifies the training; CheckpointError if it is another one.
    """
    own = hashlib.sha256(repr(of).encode() + torch.__version__.encode()).hexdigest()
    mark = folder / _MARK
    found = load(mark)
    if found is not None and found[1].get("of") != own:
        raise CheckpointError(
            f"{folder} holds an interrupted training of other data or options; repeat its command, "
            "or remove it"
        )
    output_folder(folder)
    if found is None:
        save(mark, {}, {"of": own})


def pack(prefix: str, state: dict[str, Tensor]) -> dict[str, NDArray[Any]]:
    """Return tensors as arrays of the same shape, named `prefix.NAME`."""
    return {f"{prefix}.{name}": t.detach().cpu().numpy().copy() for name, t in state.items()}


def unpack(prefix: str, arrays: dict[str, NDArray[Any]]) -> dict[str, Tensor]:
    """Return the tensors that `pack` named so, of the same shape."""
    return {
        name.removeprefix(f"{prefix}."): torch.from_numpy(np.array(array))
        for name, array in arrays.items()
        if name.startswith(f"{prefix}.")
    }


def optimizer_state(optimizer: torch.optim.Optimizer) -> dict[str, Tensor]:
    """Return an optimizer's state, by "PARAMETER-QUANTITY"."""
    return {
        f"{number}-{quantity}": torch.as_tensor(value)
        for number, state in optimizer.state_dict()["state"].items()
        for quantity, value in state.items()
        if value is not None
    }


def restore_optimizer(optimizer: torch.optim.Optimizer, state: dict[str, Tensor]) -> None:
    """Give an optimizer the state that `optimizer_state` returned."""
    values: dict[int, dict[str, Tensor]] = {}
    for name, value in state.items():
        number, _, quantity = name.partition("-")
        values.setdefault(int(number), {})[quantity] = value
    optimizer.load_state_dict({**optimizer.state_dict(), "state": values})
