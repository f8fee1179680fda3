"""Training of the network of contacts' radii, on simulated contacts, and its part of a bundle."""

import math
import os
import shutil
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import tomli_w
import torch
from torch import Tensor, nn

from controller.bundles import bundle, container
from controller.recognition.contact_radius import ContactSettings, RadiusNetwork
from controller.recordings.recording import software
from controller.shared import files, npz
from controller.shared.aliases import Say
from models import formatting, processes
from models.data import contacts
from models.data.contacts import Contacts
from models.data.simulate import DataSet
from models.training import checkpoint
from models.training.request import Request

LABEL: Final = "press"  # the gesture of a single finger
SEVERAL: Final = ("pinch", "twist_cw", "twist_ccw")  # gestures of several fingers
PARTS: Final = 25  # simulated one by one, the last is held out
ORBS: Final = 160  # of each part
EPOCHS: Final = 10
HIDDEN_UNITS: Final = 96  # of both hidden layers
BATCH: Final = 2048
RATE: Final = 3e-3  # the highest learning rate
DECAY: Final = 1e-3
FINGER_MM: Final = 9.0  # no fingertip is wider
ELBOW_MM: Final = 14.0  # no elbow is narrower


def train_contacts(request: Request, base: Path, say: Say, orbs: int = ORBS) -> str:
    """Write the bundle `base` with a network of contacts' radii for its sensor.

    Raises:
        ValueError: The bundle has no gesture of a single finger.
    """
    loaded = bundle.read(base)
    if LABEL not in loaded.labels:
        raise ValueError(
            f"{base} answers {', '.join(loaded.labels[1:])}; the width of a contact is for bundles "
            f"that answer {LABEL}"
        )
    folder = request.out.with_name(f"{request.out.name}.training")
    rounds = request.epochs or EPOCHS
    checkpoint.claim(folder, ("contacts", loaded.hash, request.seed, orbs, rounds, software()))
    grid = DataSet(rows=loaded.rows, columns=loaded.columns, pitch_mm=loaded.pitch_mm)
    draw = partial(contacts.simulate, grid.model(), loaded.rate_hz, orbs=orbs)
    paths = simulated(folder, draw, request.seed * PARTS, PARTS, say)
    parts = [Contacts(**npz.unpack(path, checkpoint.MAX_BYTES)) for path in paths]
    network = fit(parts[:-1], request.seed, rounds, say)
    several = tuple(label for label in loaded.labels if label in SEVERAL)
    settings = ContactSettings(labels=(LABEL,), several=several)
    lost, through = _shares(network, parts[-1], settings)
    touches = sum(int(one.touch[-1]) + 1 for one in parts[:-1])
    words = (
        f"{touches} simulated contacts; of others, {lost:.1%} of fingertips are refused, "
        f"{through:.0%} of contacts from 14 mm are answered"
    )
    own = {"contact": asdict(settings)}
    write(request, base, container.CONTACT, npz.pack(network.arrays()), own, words)
    shutil.rmtree(folder)
    return words


def fit(parts: list[Contacts], seed: int, epochs: int, say: Say) -> RadiusNetwork:
    """Return a network trained on contacts, by the likelihood of their radii."""
    torch.manual_seed(seed)
    inputs = torch.from_numpy(np.concatenate([one.inputs for one in parts]))
    logs = torch.from_numpy(np.concatenate([one.log_radius for one in parts]))
    prior = logs.mean(), logs.std()
    wanted = (logs - prior[0]) / prior[1]
    wide = inputs.shape[1]
    net = nn.Sequential(
        *(nn.Linear(wide, HIDDEN_UNITS), nn.ReLU()),
        *(nn.Linear(HIDDEN_UNITS, HIDDEN_UNITS), nn.ReLU()),
        nn.Linear(HIDDEN_UNITS, 2),
    )
    each = max(1, len(inputs) // BATCH)
    course = torch.optim.AdamW(net.parameters(), RATE, weight_decay=DECAY)
    pace = torch.optim.lr_scheduler.OneCycleLR(course, RATE, total_steps=epochs * each + 1)
    for epoch in range(epochs):
        total, order = 0.0, torch.randperm(len(inputs))
        for batch in order[: each * BATCH].tensor_split(each):
            loss = _surprise(net(inputs[batch].float()), wanted[batch])
            course.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            course.step()
            pace.step()
            total += float(loss.detach())
        say(f"contacts: epoch {epoch + 1} of {epochs}, loss {total / each:.3f}")
    arrays = [one.detach().numpy() for one in net.parameters()]
    names = ("first", "first_bias", "second", "second_bias", "out", "out_bias")
    known = dict(zip(names, arrays, strict=True))
    return RadiusNetwork(**known, prior=np.array(prior, dtype=np.float32))


def _surprise(out: Tensor, wanted: Tensor) -> Tensor:
    """Return the negative log-likelihood of radii, (n,), under means and ln variances, (n, 2)."""
    off, log_variance = out[:, 0] - wanted, out[:, 1]
    return 0.5 * (off * off * torch.exp(-log_variance) + log_variance).mean()


def simulated(
    folder: Path, draw: Callable[[int], Any], seed: int, parts: int, say: Say
) -> list[Path]:
    """Return the files of parts: what `draw` returns for the seed of each, unless it is there."""
    paths = [folder / f"contacts-{number:02d}.npz" for number in range(parts)]
    jobs = {
        number: partial(_write_part, draw, path, seed + number)
        for number, path in enumerate(paths)
        if not path.exists()
    }
    there, workers = parts - len(jobs), os.cpu_count() or 1
    for done, (_, _, left_s) in enumerate(processes.completed(jobs, workers), there + 1):
        left = formatting.duration(left_s)
        say(f"contacts: {done} of {parts} parts simulated; {left} left")
    return paths


def _write_part(draw: Callable[[int], Any], path: Path, seed: int) -> None:
    files.atomic_write(path, npz.pack(asdict(draw(seed))))


def _shares(
    network: RadiusNetwork, held: Contacts, settings: ContactSettings
) -> tuple[float, float]:
    """Return the share of fingertips that are refused, and of elbows that are answered."""
    logs, variances = network.estimates(held.inputs.astype(np.float32))
    begins = np.flatnonzero(np.diff(held.touch, prepend=-1))
    refused, wide = [], []
    for one in np.split(np.arange(len(logs)), begins[1:]):
        refused.append(settings.too_wide(*network.combined(logs[one], variances[one])))
        wide.append(math.exp(float(np.median(held.log_radius[one]))))
    no, radius = np.array(refused), np.array(wide)
    return float(no[radius <= FINGER_MM].mean()), float(1.0 - no[radius >= ELBOW_MM].mean())


def write(
    request: Request, base: Path, part: str, data: bytes, settings: dict[str, Any], words: str
) -> None:
    """Write the bundle `base` with another part, some settings, and a line in its card."""
    parts = container.unpack(files.read_bytes(base, container.MAX_BYTES))
    table = container.manifest(parts[container.MANIFEST])
    card = table.pop("card")  # it stands last
    table |= settings
    table["card"] = {**card, part.removesuffix(".npz"): f"{request.command}; {words}"}
    own = {**container.content(parts), part: data}
    bundle.write(request.out, manifest=tomli_w.dumps(table).encode(), parts=own)
