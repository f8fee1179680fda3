"""Training of the network of what touches in each frame, on simulated contacts that move."""

import shutil
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np
import torch
from torch import Tensor, nn

from controller.bundles import bundle, container
from controller.recognition.contact import (
    MOST_FINGERS,
    OUTPUTS,
    PICTURES,
    TURNS,
    VALUES,
    ContactNetwork,
    Matrix,
)
from controller.recognition.images.frames import PreprocessSettings
from controller.recordings.recording import software
from controller.shared import files, npz
from controller.shared.aliases import Say
from models.data import moving_contacts
from models.data.moving_contacts import MovingContacts
from models.data.simulate import DataSet
from models.results.training import StateResult
from models.training import checkpoint
from models.training.contact_task import simulated, write
from models.training.request import Request

PARTS: Final = 52  # simulated one by one, the last is held out
ORBS: Final = 90  # of each part
EPOCHS: Final = 36
UNITS: Final = 224  # of both hidden layers
BATCH: Final = 4096
RATE: Final = 6e-3  # the highest learning rate
DECAY: Final = 1e-3
GOLDEN: Final = 16  # vectors in the bundle
BITS: Final = 9  # of the weights' precision: they take a third of the space in the bundle's file
# Least deviations of place, depth, rise (shares of those in training) and angle (degrees)
# that the likelihood knows: else it is all of contacts that do not move.
LEAST: Final = (0.02, 0.04, 0.0, 0.1)
LEAST_DEG: Final = 4.0
TURNED_DEG, TURNED = 8.0, 3.0  # an angle from here on weighs so much: most contacts do not turn
AXES: Final = torch.tensor([2.0, 1.0, 1.0, 1.0])  # quantities of each variance
FIRM_MM: Final = 2.0  # contacts that the errors in the card are of


def train_state(request: Request, base: Path, say: Say, orbs: int = ORBS) -> StateResult:
    """Write the bundle `base` with a network of what touches its sensor in each frame."""
    loaded = bundle.read(base)
    folder = request.out.with_name(f"{request.out.name}.training")
    rounds = request.epochs or EPOCHS
    checkpoint.claim(folder, ("state", loaded.hash, request.seed, orbs, rounds, software()))
    grid = DataSet(rows=loaded.rows, columns=loaded.columns, pitch_mm=loaded.pitch_mm)
    draw = partial(_write_part, grid, loaded.preprocess, orbs)
    paths = simulated(folder, draw, request.seed * PARTS, PARTS, say)
    parts = [MovingContacts(**npz.unpack(path, checkpoint.MAX_BYTES)) for path in paths]
    network = fit(parts[:-1], (loaded.rows, loaded.columns), request.seed, rounds, say)
    held = parts[-1]
    golden = held.inputs[:: max(1, len(held.inputs) // GOLDEN)].astype(np.float32)
    arrays = {"golden_inputs": golden, "golden_outputs": network.outputs(golden)}
    weights = {name: array.astype(np.float16) for name, array in network.arrays().items()}
    frames = sum(len(one.inputs) for one in parts[:-1])
    result = _judged(network, held, request.out.name, frames, loaded.pitch_mm)
    data = npz.pack({**weights, "scale": network.scale, **arrays})
    write(request, base, container.STATE, data, {}, result.words)
    shutil.rmtree(folder)
    return result


def fit(
    parts: list[MovingContacts], grid: tuple[int, int], seed: int, epochs: int, say: Say
) -> ContactNetwork:
    """Return a network for a grid (rows, columns), trained by the likelihood of what touches."""
    torch.manual_seed(seed)
    inputs = torch.from_numpy(np.concatenate([one.inputs for one in parts]))
    truth = torch.from_numpy(np.concatenate([one.truth for one in parts]))
    fingers = torch.from_numpy(np.concatenate([one.fingers for one in parts]))
    there = truth[fingers > 0]
    middle = torch.tensor([(grid[1] - 1) / 2, (grid[0] - 1) / 2])
    mean = torch.cat([middle, there[:, 2:].mean(dim=0)])
    mean[3:5] = 0.0
    deviation = there.std(dim=0)
    deviation[:2] = deviation[:2].mean()
    least = torch.tensor(LEAST)
    least[2] = LEAST_DEG / float(deviation[3])
    least = torch.square(least)
    net = nn.Sequential(
        *(nn.Linear(inputs.shape[1], UNITS), nn.ReLU()),
        *(nn.Linear(UNITS, UNITS), nn.ReLU()),
        nn.Linear(UNITS, OUTPUTS),
    )
    each = max(1, len(inputs) // BATCH)
    course = torch.optim.AdamW(net.parameters(), RATE, weight_decay=DECAY)
    pace = torch.optim.lr_scheduler.OneCycleLR(course, RATE, total_steps=epochs * each + 1)
    for epoch in range(epochs):
        total, order = 0.0, torch.randperm(len(inputs))
        for batch in order[: each * BATCH].tensor_split(each):
            seen, wanted = _turned(inputs[batch].float(), truth[batch], grid)
            loss = _surprise(net(seen), (wanted - mean) / deviation, fingers[batch], least)
            course.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            course.step()
            pace.step()
            total += float(loss.detach())
        say(f"state: epoch {epoch + 1} of {epochs}, loss {total / each:.3f}")
    names = ("first", "first_bias", "second", "second_bias", "out", "out_bias")
    arrays = [_short(one.detach()) for one in net.parameters()]
    scale = torch.stack([mean, deviation]).numpy().astype(np.float32)
    return ContactNetwork(**dict(zip(names, arrays, strict=True)), scale=scale)


def _short(weights: Tensor) -> Matrix:
    """Return weights that half-precision numbers of `BITS` bits represent."""
    mantissa, exponent = np.frexp(weights.numpy())
    rounded = np.ldexp(np.round(mantissa * 2**BITS) / 2**BITS, exponent)
    return np.asarray(rounded.astype(np.float16).astype(np.float32))


def _turned(inputs: Tensor, truth: Tensor, grid: tuple[int, int]) -> tuple[Tensor, Tensor]:
    """Return inputs (n, inputs), truth (n, VALUES) of a mirrored or turned sensor, drawn at random.

    Fewer touches teach as much: the physics is the same in a mirror.
    """
    rows, columns = grid
    size = PICTURES * rows * columns
    pictures, truth = inputs[:, :size].view(-1, PICTURES, rows, columns), truth.clone()
    across, along, swapped = torch.rand(3) < 0.5
    if across:
        pictures = pictures.flip(3)
        truth[:, 0] = columns - 1 - truth[:, 0]
    if along:
        pictures = pictures.flip(2)
        truth[:, 1] = rows - 1 - truth[:, 1]
    if swapped := bool(swapped) and rows == columns:
        pictures = pictures.transpose(2, 3)
        truth[:, :2] = rows - 1 - truth[:, :2].flip(1)
    others = inputs[:, size:]
    if (bool(across) + bool(along) + swapped) % 2:
        truth[:, 3] = -truth[:, 3]
        others = others.clone()
        others[:, -TURNS:] = -others[:, -TURNS:]
    return torch.cat([pictures.reshape(-1, size), others], dim=1), truth


def _surprise(out: Tensor, wanted: Tensor, fingers: Tensor, least: Tensor) -> Tensor:
    """Return the negative log-likelihood of what touches, in deviations, under outputs."""
    variance = torch.exp(out[:, VALUES : -1 - MOST_FINGERS]) + least
    off = torch.square(out[:, :VALUES] - wanted)
    off = torch.cat([off[:, :2].sum(dim=1, keepdim=True), off[:, 2:]], dim=1)
    surprise = 0.5 * (off / variance + AXES * torch.log(variance))
    moved = wanted[:, 3].abs() > TURNED_DEG / LEAST_DEG * least[2].sqrt()
    there = (fingers > 0).float()
    weights = there[:, None].repeat(1, len(LEAST))
    weights[:, 2] = (fingers > 1) * torch.where(moved, TURNED, 1.0)
    number = nn.functional.cross_entropy(out[:, -1 - MOST_FINGERS :], fingers)
    return (surprise * weights).sum(dim=1).mean() + number


def _write_part(
    grid: DataSet, settings: PreprocessSettings, orbs: int, path: Path, seed: int
) -> None:
    """Simulate a part of the contacts into its file."""
    made = moving_contacts.simulate(grid.model(), settings, seed, orbs)
    files.atomic_write(path, npz.pack(asdict(made)))


def _judged(
    network: ContactNetwork, held: MovingContacts, name: str, frames: int, pitch_mm: float
) -> StateResult:
    """Return the median errors of contacts that were held out."""
    out = network.outputs(held.inputs.astype(np.float32))
    error = np.abs(network.scale[0] + network.scale[1] * out[:, :VALUES] - held.truth)
    firm = held.truth[:, 2] > FIRM_MM
    one, turned = firm & (held.fingers == 1), firm & (held.fingers > 1)
    return StateResult(
        name,
        frames,
        pitch_mm * float(np.median(error[one, :2])),
        float(np.median(error[one, 2])),
        float(np.median(error[turned, 3])),
        float((out[firm, -1 - MOST_FINGERS :].argmax(axis=1) == held.fingers[firm]).mean()),
    )
