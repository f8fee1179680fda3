"""Training of the network of what touches in each frame, on simulated contacts that move."""

import shutil
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
from controller.recordings.recording import software
from controller.shared import npz
from controller.shared.aliases import Say
from controller.simulator.session import LABELS
from models.data import moving_contacts
from models.data.moving_contacts import UNKNOWN_LABEL, MovingContacts
from models.data.simulate import DataSet
from models.training import checkpoint
from models.training.contact_task import simulated, write
from models.training.request import Request

PARTS: Final = 71  # simulated one by one, the last is held out
ORBS: Final = 60  # of each part, trained together
EPOCHS: Final = 24
HIDDEN_UNITS: Final = 192  # of the hidden layer, and recurrent ones
CHUNK: Final = 72  # frames that an error is followed back
RATE: Final = 4e-3  # the highest learning rate
CLIP: Final = 1.0  # the greatest norm of a gradient
DECAY: Final = 1e-3
GOLDEN: Final = 40  # frames in the bundle
BITS: Final = 9  # of the weights' precision: they take a third of the space in the bundle's file
# Least deviations of place, depth, rise (shares of those in training) and angle (degrees)
# that the likelihood knows: else it is all of contacts that do not move.
LEAST: Final = (0.02, 0.04, 0.0, 0.1)
LEAST_DEG: Final = 4.0
TURNED_DEG, TURNED = 8.0, 3.0  # an angle from here on weighs so much: most contacts do not turn
AXES: Final = torch.tensor([2.0, 1.0, 1.0, 1.0])  # quantities of each variance
TWIST_CLASSES: Final = tuple(LABELS.index(label) for label in ("twist_cw", "twist_ccw"))
# The network's arrays in the order of PyTorch's parameters
WEIGHTS: Final = (
    *("first", "first_bias", "gates", "memory", "gates_bias", "memory_bias"),
    *("out", "out_bias"),
)
FIRM_MM: Final = 2.0  # contacts that the errors in the card are of


def train_state(
    request: Request, base: Path, say: Say, orbs: int = ORBS, parts: int = PARTS
) -> str:
    """Write the bundle `base` with a network of what touches its sensor in each frame."""
    loaded = bundle.read(base)
    folder = request.out.with_name(f"{request.out.name}.training")
    rounds = request.epochs or EPOCHS
    checkpoint.claim(folder, ("state", loaded.hash, request.seed, orbs, parts, rounds, software()))
    grid = DataSet(rows=loaded.rows, columns=loaded.columns, pitch_mm=loaded.pitch_mm)
    plays = loaded.labels[: len(LABELS)] == LABELS  # the simulated hand knows the gestures
    draw = partial(
        moving_contacts.simulate, grid.model(), loaded.preprocess, orbs=orbs, gestures=plays
    )
    paths = simulated(folder, draw, request.seed * PARTS, parts, say)
    made = [MovingContacts(**npz.unpack(path, checkpoint.MAX_BYTES)) for path in paths]
    known = len(LABELS) if plays else 0
    network = fit(made[:-1], (loaded.rows, loaded.columns), known, request.seed, rounds, say)
    held = made[-1]
    golden = held.inputs[0, :GOLDEN].astype(np.float32)
    arrays = {"golden_inputs": golden, "golden_outputs": network.outputs(golden)}
    weights = {name: array.astype(np.float16) for name, array in network.arrays().items()}
    frames = sum(one.fingers.size for one in made[:-1])
    words = f"{frames} simulated frames; {_judged(network, held, loaded.pitch_mm)}"
    data = npz.pack({**weights, "scale": network.scale, **arrays})
    write(request, base, container.STATE, data, {}, words)
    shutil.rmtree(folder)
    return words


class RecurrentNetwork(nn.Module):
    """What `ContactNetwork` computes, of many orbs' frames at once."""

    def __init__(self, wide: int, labels: int) -> None:
        """Draw the weights for so many inputs, and labels that it says."""
        super().__init__()
        self.first = nn.Linear(wide, HIDDEN_UNITS)
        self.units = nn.GRU(HIDDEN_UNITS, HIDDEN_UNITS, batch_first=True)
        self.out = nn.Linear(2 * HIDDEN_UNITS, OUTPUTS + labels)

    def forward(self, inputs: Tensor, before: Tensor | None) -> tuple[Tensor, Tensor]:
        """Return the outputs of inputs (orbs, frames, wide), and the units after them."""
        hidden = torch.relu(self.first(inputs))
        units, last = self.units(hidden, before)
        return self.out(torch.cat([units, hidden], dim=2)), last.detach()


def fit(
    parts: list[MovingContacts],
    grid: tuple[int, int],
    labels: int,
    seed: int,
    epochs: int,
    say: Say,
) -> ContactNetwork:
    """Return a network for a grid (rows, columns), trained by the likelihood of what touches.

    It says so many labels, those of the simulated hand or none.
    """
    torch.manual_seed(seed)
    there = torch.from_numpy(np.concatenate([one.truth[one.fingers > 0] for one in parts]))
    middle = torch.tensor([(grid[1] - 1) / 2, (grid[0] - 1) / 2])
    mean = torch.cat([middle, there[:, 2:].mean(dim=0)])
    mean[3:5] = 0.0
    deviation = there.std(dim=0)
    deviation[:2] = deviation[:2].mean()
    least = torch.tensor(LEAST)
    least[2] = LEAST_DEG / float(deviation[3])
    least = torch.square(least)
    frames, wide = parts[0].inputs.shape[1:]
    net = RecurrentNetwork(wide, labels)
    chunks = [slice(at, at + CHUNK) for at in range(0, frames, CHUNK)]
    steps = epochs * len(parts) * len(chunks)
    course = torch.optim.AdamW(net.parameters(), RATE, weight_decay=DECAY)
    pace = torch.optim.lr_scheduler.OneCycleLR(course, RATE, total_steps=steps)
    for epoch in range(epochs):
        total = 0.0
        for number in torch.randperm(len(parts)).tolist():
            seen, wanted, fingers, said = tensors(parts[number], grid)
            wanted, before = (wanted - mean) / deviation, None
            for chunk in chunks:
                out, before = net(seen[:, chunk], before)
                loss = surprise(out, wanted[:, chunk], fingers[:, chunk], least)
                if labels:
                    loss = loss + _unnamed(out[..., OUTPUTS:], said[:, chunk])
                course.zero_grad()
                loss.backward()  # type: ignore[no-untyped-call]
                nn.utils.clip_grad_norm_(net.parameters(), CLIP)
                course.step()
                pace.step()
                total += float(loss.detach())
        say(f"state: epoch {epoch + 1} of {epochs}, loss {total / len(parts) / len(chunks):.3f}")
    return network_of(net, torch.stack([mean, deviation]))


def network_of(net: RecurrentNetwork, scale: Tensor) -> ContactNetwork:
    """Return a network's short weights, with the mean and deviation of the quantities."""
    arrays = dict(zip(WEIGHTS, (_short(one.detach()) for one in net.parameters()), strict=True))
    return ContactNetwork(**arrays, scale=scale.numpy().astype(np.float32))


def _short(weights: Tensor) -> Matrix:
    """Return weights that half-precision numbers of `BITS` bits represent."""
    mantissa, exponent = np.frexp(weights.numpy())
    rounded = np.ldexp(np.round(mantissa * 2**BITS) / 2**BITS, exponent)
    return np.asarray(rounded.astype(np.float16).astype(np.float32))


def tensors(part: MovingContacts, grid: tuple[int, int]) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Return inputs, truth, fingers and labels of orbs that are mirrored or turned at random.

    Fewer touches teach as much: the physics is the same in a mirror.
    """
    inputs, truth = torch.from_numpy(part.inputs).float(), torch.from_numpy(part.truth).clone()
    rows, columns = grid
    size = PICTURES * rows * columns
    shape = (*inputs.shape[:2], PICTURES, rows, columns)
    pictures = inputs[..., :size].reshape(shape)
    across, along, swapped = torch.rand(3) < 0.5
    if across:
        pictures = pictures.flip(4)
        truth[..., 0] = columns - 1 - truth[..., 0]
    if along:
        pictures = pictures.flip(3)
        truth[..., 1] = rows - 1 - truth[..., 1]
    if swapped := bool(swapped) and rows == columns:
        pictures = pictures.transpose(3, 4)
        truth[..., :2] = rows - 1 - truth[..., :2].flip(2)
    others, label = inputs[..., size:], torch.from_numpy(part.label).long()
    if (bool(across) + bool(along) + swapped) % 2:
        truth[..., 3] = -truth[..., 3]
        others = others.clone()
        others[..., -TURNS:] = -others[..., -TURNS:]
        label = torch.where(label >= TWIST_CLASSES[0], sum(TWIST_CLASSES) - label, label)
    seen = torch.cat([pictures.flatten(2), others], dim=2)
    return seen, truth, torch.from_numpy(part.fingers), label


def surprise(out: Tensor, wanted: Tensor, fingers: Tensor, least: Tensor) -> Tensor:
    """Return the negative log-likelihood of what touches under outputs (orbs, frames, OUTPUTS).

    What is wanted is in deviations, (orbs, frames, VALUES). Labels are not counted.
    """
    variance = torch.exp(out[..., VALUES : OUTPUTS - 1 - MOST_FINGERS]) + least
    off = torch.square(out[..., :VALUES] - wanted)
    off = torch.cat([off[..., :2].sum(dim=2, keepdim=True), off[..., 2:]], dim=2)
    surprise = 0.5 * (off / variance + AXES * torch.log(variance))
    moved = wanted[..., 3].abs() > TURNED_DEG / LEAST_DEG * least[2].sqrt()
    there = (fingers > 0).float()
    weights = there[..., None].repeat(1, 1, len(LEAST))
    weights[..., 2] = (fingers > 1) * torch.where(moved, TURNED, 1.0)
    logits = out[..., OUTPUTS - 1 - MOST_FINGERS : OUTPUTS]
    number = nn.functional.cross_entropy(logits.flatten(0, 1), fingers.flatten().long())
    return (surprise * weights).sum(dim=2).mean() + number


def _unnamed(logits: Tensor, said: Tensor) -> Tensor:
    """Return the mean negative log-likelihood of labels, (orbs, frames), where they are known."""
    own = said != UNKNOWN_LABEL
    loss = nn.functional.cross_entropy(logits[own], said[own], reduction="sum")
    return loss / own.sum().clamp(min=1)


def _judged(network: ContactNetwork, held: MovingContacts, pitch_mm: float) -> str:
    """Return the median errors of contacts that were held out, in a clause."""
    out = np.array([network.outputs(orb.astype(np.float32)) for orb in held.inputs])
    error = np.abs(network.scale[0] + network.scale[1] * out[..., :VALUES] - held.truth)
    number, firm = out[..., OUTPUTS - 1 - MOST_FINGERS : OUTPUTS], held.truth[..., 2] > FIRM_MM
    one, turned = firm & (held.fingers == 1), firm & (held.fingers > 1)
    place_mm, depth_mm = pitch_mm * np.median(error[one][:, :2]), np.median(error[one][:, 2])
    counted = (number.argmax(axis=2) == held.fingers)[firm].mean()
    return (
        f"median errors of others: place {place_mm:.2f} mm, depth {depth_mm:.2f} mm, angle "
        f"{np.median(error[turned][:, 3]):.1f}°; {counted:.0%} with the right number of fingers"
    )
