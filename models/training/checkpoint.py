"""Checkpoints of interrupted trainings: plain arrays and JSON in one `.npz`, never pickled.

A checkpoint is taken after every epoch and holds the random generators too, so that a training
that goes on gives the same bytes as one that was never interrupted.
"""

import hashlib
import io
import json
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from controller import files, npz
from controller.errors import UserError
from models import user_files

MAX_BYTES: Final = 1 << 30
_WORDS: Final = "words"  # the JSON among the arrays


class CheckpointError(UserError, ValueError):
    """The folder holds what another training left; the message is one sentence."""


def save(path: Path, arrays: dict[str, NDArray[Any]], words: dict[str, Any]) -> None:
    """Write a checkpoint, complete or not at all.

    Raises:
        OSError: It cannot be written; the one before it is as it was.
    """
    whole = io.BytesIO()
    np.savez(whole, allow_pickle=False, **{_WORDS: np.array(json.dumps(words))}, **arrays)
    files.atomic_write(path, whole.getvalue())


def load(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]] | None:
    """Return what a checkpoint holds; None: there is none.

    Raises:
        CheckpointError: It cannot be read.
    """
    if not path.is_symlink() and not path.exists():
        return None
    try:
        arrays = npz.unpack(path, MAX_BYTES)
        words = json.loads(str(arrays.pop(_WORDS)))
        return arrays, dict(words)
    except (ValueError, KeyError, TypeError, RecursionError):
        raise damaged(path) from None


def damaged(path: Path) -> CheckpointError:
    """Return the error that a checkpoint does not hold what it should."""
    return CheckpointError(f"{path} is damaged; remove it, and training begins anew")


def claim(folder: Path, name: str, of: object, what: str) -> Path:
    """Return a folder of checkpoints: of this work, or new.

    Args:
        folder: Where they are kept.
        name: Of the mark in it that says whose they are.
        of: All that the work depends on; its representation tells it from others.
        what: The work, for people.

    Raises:
        CheckpointError: They are another one's.
    """
    own = hashlib.sha256(repr(of).encode() + torch.__version__.encode()).hexdigest()
    mark = folder / name
    found = load(mark)
    if found is not None and found[1].get("of") != own:
        raise CheckpointError(
            f"{folder} holds an interrupted {what} of other data or options; repeat its command, "
            "or remove it"
        )
    user_files.folder_target(folder)
    if found is None:
        save(mark, {}, {"of": own})
    return folder


def pack(prefix: str, state: dict[str, Tensor]) -> dict[str, NDArray[Any]]:
    """Return tensors as arrays, named `prefix.NAME`."""
    return {f"{prefix}.{name}": t.detach().cpu().numpy().copy() for name, t in state.items()}


def unpack(prefix: str, arrays: dict[str, NDArray[Any]]) -> dict[str, Tensor]:
    """Return the tensors that `pack` named so."""
    return {
        name.removeprefix(f"{prefix}."): torch.from_numpy(np.array(array))
        for name, array in arrays.items()
        if name.startswith(f"{prefix}.")
    }


def optimizer_state(net: nn.Module, optimizer: torch.optim.Optimizer) -> dict[str, Tensor]:
    """Return what an optimizer remembers of each parameter, by "PARAMETER-QUANTITY"."""
    return {
        f"{name}-{quantity}": torch.as_tensor(value)
        for name, parameter in net.named_parameters()
        for quantity, value in optimizer.state[parameter].items()
        if value is not None
    }


def restore_optimizer(
    net: nn.Module, optimizer: torch.optim.Optimizer, state: dict[str, Tensor]
) -> None:
    """Let an optimizer remember what `optimizer_state` returned."""
    parameters = dict(net.named_parameters())
    for name, value in state.items():
        owner, _, quantity = name.partition("-")
        parameter = parameters[owner]
        # Laid out in memory as the parameter is: fused optimisers go through both in one row.
        like = value if quantity == "step" else torch.empty_like(parameter).copy_(value)
        optimizer.state[parameter][quantity] = like.detach()
