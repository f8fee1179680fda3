"""Training driver: from folders of recordings to a proven bundle, its card and its report."""

import shutil
from dataclasses import replace
from pathlib import Path

from controller.bundles import bundle
from controller.recordings.recording import software
from models.data import load
from models.data.examples import refuse_test_seed
from models.results import storage
from models.results.training import Training, UserResult
from models.training import checkpoint
from models.training.loop import prepare_torch
from models.training.network_bundle import NetworkPlan
from models.training.request import Request, Say
from models.training.user_bundle import UserPlan


def train(request: Request, say: Say) -> Training | UserResult:
    """Train networks; write the bundle, its card and its report.

    Args:
        request: The options.
        say: Takes lines of progress.

    Raises:
        ValueError: It cannot be done; one sentence.
    """
    refuse_test_seed(request.seed, "this training")
    storage.bundle_target(request.out)
    users = request.task == "user"
    base = bundle.read(request.base or bundle.default_path())  # before anything that takes long
    device = prepare_torch(request.seed)
    data = load.read(
        (*request.paths, *request.auxiliary, *request.others),
        request.networks(),
        request.labels,
        say,
        window=base.window if users else request.window,
        every=request.every,
    )
    plan: UserPlan | NetworkPlan
    if users:
        plan = UserPlan.of(request, data, base, say)
    else:
        plan = NetworkPlan.of(request, data, base, say)
    say(f"on {device}, one thread" if device.type == "cpu" else "on a GPU")
    folder = request.out.with_name(f"{request.out.name}.training")
    of = replace(request, out=Path(), paths=(), command=""), data.digest, data.vocabulary
    checkpoint.claim(folder, "training.npz", (*of, data.settings, software()), "training")
    result = plan.train(device, folder, say)
    shutil.rmtree(folder)
    return result
