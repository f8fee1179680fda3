"""`models pretrain`: a network trained on simulated skins of many shapes, for `train --from`."""

import argparse
import os
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Final

from controller.arguments import whole
from models.cli import _options as options

SUMMARY: Final = "make a start for sensors that no bundle is for"
DESCRIPTION: Final = (
    "Train both networks on simulated skins of many grids, sizes, rates, strengths and noises, "
    "three minutes of another user each, as a start for models train --from. Interrupted, the "
    "same command goes on where it was."
)
EXAMPLE: Final = "Try it (two minutes): models pretrain --out start.orb --skins 10 --epochs 3"
SKIN_S: Final = 0.8  # CPU time of a skin until it is learned from: simulation, check, images
TRAINING_S: Final = 400.0  # CPU time of the training, without --epochs


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.set_defaults(resumes=True)
    add = parser.add_argument
    add("--out", type=Path, required=True, metavar="FILE", help="bundle to write: NAME.orb")
    add("--skins", type=whole(4, 10_000), default=120, metavar="N", help="how many (default: 120)")
    add("--epochs", type=whole(0, 10_000), default=0, metavar="N", help="as in models train")
    add("--seed", type=options.seed, default=0, help="of everything random (default: 0)")


def run(arguments: argparse.Namespace) -> int:
    """Simulate, train, and print the figures."""
    options.require("training", "torch", "tomli_w", "jinja2", "matplotlib")
    from models.data.examples import refuse_test_seed
    from models.data.simulate import generate
    from models.data.skins import Skins
    from models.formatting import duration
    from models.results import storage
    from models.training.train import Request, train

    out, skins, seed, epochs = arguments.out, arguments.skins, arguments.seed, arguments.epochs
    refuse_test_seed(seed, "this training")
    storage.bundle_target(out)
    cost_s = SKIN_S * skins + TRAINING_S * (not epochs)
    options.say(f"about {duration(cost_s)} of CPU time{', and the epochs' * bool(epochs)}")
    folder, begun = out.with_name(f"{out.name}.skins"), sum(os.times()[:4])
    generate(Skins(seed=seed), folder, skins, 1, os.cpu_count() or 1, options.say)
    command = f"models pretrain --skins {skins} --seed {seed} --epochs {epochs} --out {out.name}"
    request = Request((folder,), out, "both", split="user", seed=seed, epochs=epochs)
    train(replace(request, unmeasured=True, command=command), options.say)
    card, spent = out.with_suffix(".md"), duration(sum(os.times()[:4]) - begun)
    words = f"Seed {seed}, {skins} skins. CPU time of the command's last run: {spent}.\n"
    storage.write_text(card, f"{storage.read_text(card)}\n{words}")
    shutil.rmtree(folder)
    options.say(f"wrote {out}; next: models train DIR --from {out} --out my.orb")
    return 0
