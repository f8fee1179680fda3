"""Peers in the recognition benchmark: trained once, tuned and judged as ours."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles.bundle import Bundle
from controller.recognition.debounce import DebounceSettings
from controller.recordings.recording import Recording
from controller.shared.aliases import Say
from models.data.ground_truth import GroundTruth
from models.data.simulate import DataSet, generate
from models.data.test_sessions import People
from models.evaluation import replay as replays
from models.evaluation.evaluate import summarise
from models.evaluation.event_counts import Tally, tally
from models.evaluation.tune import Goal, tune
from models.results.evaluation import Result

if TYPE_CHECKING:
    from .peers import Peer

LEARN: Final = DataSet(seed=11, minutes=6.0)  # what peers learn from, on each preset
LEARN_USERS: Final = 16
TUNE: Final = DataSet(seed=12, minutes=5.0)  # where their thresholds are chosen
TUNE_USERS: Final = 6
NEEDED: Final = ("torch", "sklearn")
OURS: Final = "ours_there"  # the bundle itself on the sessions that peers are judged on


def judge_peers(
    loaded: Bundle, people: Mapping[str, People], count: int, cache: Path, say: Say, *, again: bool
) -> dict[tuple[str, str], Result]:
    """Return how every peer does: (name, preset) -> figures; none where a package is missing."""
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        say(f"peers are missing: {' and '.join(missing)} cannot be imported")
        return {}
    from . import peers

    folders = [cache / "peers" / preset for preset in people]
    for preset, folder in zip(people, folders, strict=True):
        generate(replace(LEARN, preset=preset), folder, LEARN_USERS, 1, 1, lambda line: None)
    own = [peers.train(name, folders, cache, say, again=again) for name in peers.NAMES]
    thresholds = {peer.name: _tuned(peer, loaded, tuple(people)) for peer in own}
    results = {}
    for preset, who in people.items():
        tallies = _played(loaded, own, thresholds, who.sessions(count))
        for name, each in tallies.items():
            results[name, preset] = summarise(preset, loaded.labels, each)
            say(f"{preset} {name}: F1 {results[name, preset].f1}")
    return results


def _tuned(peer: "Peer", loaded: Bundle, presets: Sequence[str]) -> DebounceSettings:
    """Return the thresholds that development sessions of all presets choose for a peer."""
    streams = []
    for preset in presets:
        for name, recording in People(replace(TUNE, preset=preset), TUNE_USERS).sessions(
            TUNE_USERS
        ):
            known = GroundTruth.of(recording, loaded.labels, name)
            inputs = replays.network_inputs(recording.frames, peer.settings)
            streams.append(
                replays.debounced_stream(
                    known, inputs, peer.gesture(inputs.windows), loaded.labels, loaded.debounce
                )
            )
    found = tune(peer.name, loaded.labels, loaded.debounce, streams, Goal())
    return found.chosen.settings


def _played(
    loaded: Bundle,
    peers: Sequence["Peer"],
    thresholds: Mapping[str, DebounceSettings],
    sessions: Iterable[tuple[str, Recording]],
) -> dict[str, list[Tally]]:
    """Let all play the same sessions."""
    networks = _Keeping(loaded)
    tallies: dict[str, list[Tally]] = {OURS: [], **{peer.name: [] for peer in peers}}
    for name, recording in sessions:
        known = GroundTruth.of(recording, loaded.labels, name)
        inputs = replays.network_inputs(recording.frames, loaded.preprocess)
        ours = replays.replay(loaded, networks, recording, known, inputs)
        tallies[OURS].append(tally(ours, loaded.labels))
        for peer in peers:
            same = peer.settings == loaded.preprocess
            seen = inputs if same else replays.network_inputs(recording.frames, peer.settings)
            answers = peer.gesture(seen.windows)
            stream = replays.debounced_stream(
                known, seen, answers, loaded.labels, thresholds[peer.name]
            )
            stream = replace(stream, touches=_places(peer, ours, networks, seen))
            tallies[peer.name].append(tally(stream, loaded.labels))
    return tallies


class _Keeping(replays.Batched):
    """A bundle's networks that keep the images they were asked about."""

    images: NDArray[np.float32]

    def touches(self, images: NDArray[np.float32]) -> NDArray[np.float32] | None:
        """Return where images are touched."""
        self.images = images
        return super().touches(images)


def _places(
    peer: "Peer", ours: replays.Stream, networks: _Keeping, seen: replays.NetworkInputs
) -> NDArray[np.float64]:
    """Return where a peer sees touches, (n, 2): in our images, the paper's by frames' median."""
    touches = np.full(ours.touches.shape, np.nan)
    if peer.place is None:
        return touches
    if peer.averaged:
        asked = np.isfinite(ours.touches[:, 0])
        if asked.any():
            touches[asked] = peer.place(networks.images)
        return touches
    pressed = np.isfinite(ours.truth.place[seen.last, 0])
    if pressed.any():
        touches[seen.last[pressed]] = peer.place(seen.windows[pressed, -1])
        for frames in _events(ours.truth):
            touches[frames] = _median(touches[frames])
    return touches


def _events(known: GroundTruth) -> list[slice]:
    edges = [np.searchsorted(known.t, (e.onset_s, e.release_s)) for e in known.events]
    return [slice(int(first), int(end)) for first, end in edges]


def _median(places: NDArray[np.float64]) -> NDArray[np.float64]:
    told = places[np.isfinite(places[:, 0])]
    return np.median(told, axis=0) if len(told) else np.full(2, np.nan)
