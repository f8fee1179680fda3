"""Training driver: from folders of recordings to a proven bundle, its card and its report.

The command line of `models train` is made from `Request`, so PyTorch is imported by `train` only.
"""

import re
import shutil
from dataclasses import replace
from pathlib import Path

from controller.bundles import bundle
from controller.bundles.inference.networks import Recognizer
from controller.recordings.recording import software
from controller.shared.aliases import Say
from controller.shared.errors import count
from models.data import load
from models.data.examples import read_training, refuse_test_seed
from models.data.ground_truth import GroundTruth
from models.evaluation import replay, scores, tune
from models.results import storage
from models.results.evaluation import Tuning
from models.results.training import Training, UserResult
from models.training.request import Request


def train(request: Request, say: Say) -> Training | UserResult | str:
    """Train networks; write the bundle, its card and its report; ValueError if it is impossible."""
    from models.training import checkpoint
    from models.training.contact_task import train_contacts
    from models.training.loop import prepare_torch
    from models.training.network_bundle import NetworkPlan
    from models.training.state_task import train_state
    from models.training.user_bundle import UserPlan

    refuse_test_seed(request.seed, "this training")
    storage.bundle_target(request.out)
    if request.task in ("contact", "state"):
        prepare_torch(request.seed)
        simulated = train_contacts if request.task == "contact" else train_state
        return simulated(request, request.base or bundle.default_path(), say)
    users = request.task == "user"
    paths = (*request.paths, *request.auxiliary, *request.others)
    rate_hz = read_training(paths).rate_hz
    shipped = bundle.default_path(rate_hz)
    base = bundle.read(request.base or shipped)  # before anything that takes long
    if users:
        request = replace(request, base=request.base or shipped)
    device = prepare_torch(request.seed)
    data = load.read(
        paths,
        request.networks(),
        request.labels,
        say,
        window=base.window if users else request.window,
        every=request.every,
    )
    if odd := [one for one in data.vocabulary.labels if not re.fullmatch(bundle.LABEL, one)]:
        raise ValueError(
            f"no bundle can have the label {odd[0]!r}; import the recordings again, with names of "
            "small letters, digits and _ (label_names in orbtouch docs recording)"
        )
    plan: UserPlan | NetworkPlan
    if users:
        plan = UserPlan.of(request, data, base, say)
    else:
        plan = NetworkPlan.of(request, data, base, say)
    say(f"on {device}, one thread" if device.type == "cpu" else "on a GPU")
    folder = checkpoints(request)
    of = replace(request, out=Path(), paths=(), command=""), data.digest, data.vocabulary
    checkpoint.claim(folder, (*of, data.settings, software()))
    result = plan.train(device, folder, say)
    shutil.rmtree(folder)
    return result


def checkpoints(request: Request) -> Path:
    """Return the folder of an interrupted training's checkpoints."""
    return request.out.with_name(f"{request.out.name}.training")


def choose_thresholds(request: Request, say: Say) -> Tuning:
    """Write the bundle `request.start` with thresholds chosen on recordings."""
    assert request.start is not None
    storage.bundle_target(request.out)
    loaded = bundle.read(request.start)
    recordings = read_training(request.paths)  # seeds that are for tests are refused
    for note in recordings.notes:
        say(note)
    networks, streams = Recognizer(loaded), []
    for survey, recording in zip(recordings.surveys, recordings, strict=True):
        name = survey.path.stem
        truth = GroundTruth.of(recording, loaded.labels, name, request.labels)
        bare = replace(loaded, spread=scores.BARE)
        streams.append(replay.run(bare, networks, recording, truth))
        say(f"{name}: {count(len(truth.events), 'event')}")
    found = tune.tune(loaded.labels, loaded.debounce, streams)
    on = f"{count(found.sessions, 'recording')} with {count(found.events, 'event')}"
    entry = f"on {on}; {tune.GOAL}"
    far = tune.spread(streams)
    tune.write(request.out, request.start, found.chosen.settings, entry, far)
    return found
