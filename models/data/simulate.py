"""Data sets of simulated sessions: users times sessions, one recording each (docs/data.md).

A session depends on the data set's settings, its user and its number, and on nothing else: any
number of processes writes the same bytes, in any order, at once or in several goes.
"""

import hashlib
import json
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Final, Literal

import numpy as np

from controller.bundles.bundle import Bundle
from controller.recordings import recording, writer
from controller.recordings.recording import Recording
from controller.shared import files
from controller.shared.aliases import Say
from controller.shared.errors import output_folder
from controller.simulator.dome.faults import Fault
from controller.simulator.hand.gesture_file import Repertoire, load
from controller.simulator.hand.performance import GESTURES
from controller.simulator.hand.user_style import UserStyle, person
from controller.simulator.orb import PRESETS, OrbModel, preset, vary
from controller.simulator.session import DATA, TEST_SEEDS, Protocol, Session, simulate
from models import formatting, processes
from models.results import storage

DESCRIPTION: Final = "dataset.json"  # beside the recordings: how they were made
EVALUATE_SEED: Final = TEST_SEEDS.start  # what is looked at again and again: none trains on it
_INFLATION: Final = 0.05  # sessions differ so much in how far the pump has inflated the dome
_SPAN_MM: Final = 40.0  # the paper's grid: five taxels, 10 mm apart

ORB: Final = 78  # tag of the orb that all users share
_PHYSICS: Final = 79  # tag of what a dome's physics is drawn from
_DAYS: Final = 100_000  # more than any user has

Hand = Literal["person", "pointer"]


@dataclass(frozen=True, slots=True)
class DataSet:
    """Settings that all sessions of a data set share."""

    # of its users and their sessions
    seed: int = field(default=0, metadata={"range": (0, 2**32 - 1)})
    # length of a session
    minutes: float = field(default=6.0, metadata={"range": (0.1, 1440.0)})
    protocol: Protocol = "free"
    preset: str = field(default="nominal", metadata={"choices": tuple(PRESETS)})
    hand: Hand = "person"  # source of the touches: fingers, or a pointer on a screen
    rate_hz: float = field(default=10.0, metadata={"range": (1.0, 200.0)})  # frames per second
    rows: int = field(default=5, metadata={"range": (2, 32)})  # of taxels
    columns: int = field(default=5, metadata={"range": (2, 32)})
    pitch_mm: float | None = None  # distance of two taxels; None: the grid is 40 mm, as the paper's
    gestures: tuple[str, ...] = field(default=GESTURES, metadata={"count": (1, 64)})  # labels
    files: tuple[Path, ...] = ()  # gestures of the user's own
    one_orb: bool = False  # all users touch one orb, on days of their own; else each session's own
    # share of turns in which several quick gestures follow each other
    quick: float = field(default=0.0, metadata={"range": (0.0, 1.0)})
    # share of the other turns with slides, winding up, resting hands and the like
    unruly: float = field(default=0.0, metadata={"range": (0.0, 1.0)})
    # The dome's physics differs from session to session, not its pressure only
    varied: bool = False

    @classmethod
    def of(
        cls, bundle: Bundle, preset: str, seed: int, minutes: float, hand: Hand = "person"
    ) -> "DataSet":
        """Return people who make a bundle's gestures; ValueError if the simulated hand cannot."""
        made = cls(
            seed=seed,
            minutes=minutes,
            preset=preset,
            hand=hand,
            rate_hz=bundle.rate_hz,
            rows=bundle.rows,
            columns=bundle.columns,
            pitch_mm=bundle.pitch_mm,
            gestures=bundle.labels[1:],
        )
        try:
            made.repertoire()
        except ValueError as error:
            raise ValueError(f"{error}; judge this bundle on recordings: add DIR") from None
        return made

    def model(self) -> OrbModel:
        """Return the orb; its dome is as large as the grid needs.

        Raises:
            ValueError: There is no such preset.
        """
        longest = max(self.rows, self.columns) - 1
        pitch = self.pitch_mm or round(_SPAN_MM / longest, 2)
        return replace(preset(self.preset), rows=self.rows, columns=self.columns, pitch_mm=pitch)

    def repertoire(self) -> Repertoire:
        """Return the gestures of the simulated hands.

        Raises:
            GestureError: A file holds no gesture.
            ValueError: A label is unknown, no gesture, or named twice.
        """
        known = load(self.files)
        for label in self.gestures:
            if label not in known or not known[label].usual:
                names = ", ".join(name for name, gesture in known.items() if gesture.usual)
                raise ValueError(f"there is no gesture {label!r}; there are {names}")
        if len(set(self.gestures)) < len(self.gestures):
            raise ValueError("a gesture is named twice; name each once")
        return known

    def style(self, user: int) -> UserStyle:
        """Return the touch style of a user; users count from 0."""
        return person(self.seed, user)

    def describe(self) -> str:
        """Return the settings as the text of `DESCRIPTION`."""
        own = {
            path.name: hashlib.sha256(files.read_bytes(path, storage.MAX_BYTES)).hexdigest()
            for path in self.files
        }
        settings = {**asdict(self), "pitch_mm": self.model().pitch_mm, "files": own}
        return json.dumps({**settings, "software": recording.software()}, indent=2) + "\n"

    def played(
        self,
        seeds: Sequence[np.random.SeedSequence],
        user: int,
        day: int,
        model: OrbModel,
        faults: Iterable[Fault] = (),
    ) -> Session:
        """Simulate the frames and the truth of one session.

        Args:
            seeds: Of orb, people, order, placement and button.
            user: From 0.
            day: Of a shared orb; 0: the orb is the session's own.
            model: The orb.
            faults: They are there throughout.
        """
        return simulate(
            seeds,
            self.minutes,
            style=self.style(user),
            pointer=self.hand == "pointer",
            rate_hz=self.rate_hz,
            model=model,
            protocol=self.protocol,
            inflation=_INFLATION,
            gestures=self.gestures,
            repertoire=self.repertoire(),
            faults=faults,
            day=day,
            quick=self.quick,
            unruly=self.unruly,
        )

    def session(self, user: int, number: int, faults: Iterable[Fault] = ()) -> Recording:
        """Simulate one session; users and sessions count from 0, faults are there throughout."""
        seeds = np.random.SeedSequence([DATA, self.seed], spawn_key=(user, number)).spawn(5)
        which, day = f"{self.seed}-{user + 1}-{number + 1}", 0
        if self.one_orb:
            orb = np.random.SeedSequence([DATA, self.seed, ORB])
            seeds, which = [orb, *seeds[1:]], f"{self.seed}"
            day = 1 + user * _DAYS + number
        model = self.model()
        if self.varied:
            own = () if self.one_orb else (user, number)
            model = vary(model, np.random.default_rng([DATA, self.seed, _PHYSICS, *own]))
        played = self.played(seeds, user, day, model, faults)
        origin = recording.Provenance(
            device_id=f"simulated-{which}",
            rows=model.rows,
            columns=model.columns,
            pitch_mm=model.pitch_mm,
            rate_hz=self.rate_hz,
            labels=played.labels,
            bundle="",
            engine="",
            software=recording.software(),
            user=f"{user + 1:02d}",
            session=f"{number + 1:02d}",
            protocol=self.protocol,
            preset=self.preset,
            seed=self.seed,
        )
        fingers = max(1, int(np.isfinite(played.contact[:, :, 2]).any(axis=0).sum()))
        events = sorted((*played.events, *played.distractors), key=lambda event: event.onset_s)
        frames = len(played.frames)
        unsaid = recording.unlabelled(frames)
        return Recording(
            origin,
            played.frames,
            t=played.time_s,
            sequence=np.arange(1, frames + 1, dtype=np.int64),
            label=played.label.astype(np.int16),
            button=played.button.astype(np.int16),
            key=unsaid["key"],
            cue=unsaid["cue"],
            excluded=np.zeros(frames, dtype=np.bool_),
            touch=np.full((frames, 2), np.nan),
            truth=recording.SimulatedTruth(
                played.touch, played.contact[:, :fingers], tuple(events)
            ),
        )

    def sessions(
        self, users: int, count: int, faults: Sequence[str] = ()
    ) -> Iterator[tuple[str, Recording]]:
        """Yield named sessions, users in turn, with faults from the first frame on."""
        ill = [Fault.parse(one, self.rows, self.columns) for one in faults]
        for number in range(count):
            session, user = divmod(number, users)
            name = f"{self.preset} {user + 1:02d}-{session + 1:02d}"
            yield name, self.session(user, session, ill)


def name(user: int, number: int) -> str:
    """Return the file name of a session; users and sessions count from 0, names from 1."""
    return f"sub-{user + 1:02d}_ses-{number + 1:02d}_run-01.npz"


def generate(
    data: DataSet, out: Path, users: int, sessions: int, workers: int, say: Say
) -> list[Path]:
    """Write the recordings that are missing, and return the paths of all.

    Args:
        data: Their settings.
        out: The folder; made if it does not exist.
        users: Number of users.
        sessions: Sessions of each user.
        workers: Processes.
        say: Takes lines of progress.

    Raises:
        ValueError: The folder holds something else or cannot be written to, or the settings are
            impossible.
        OSError: A recording cannot be written.
    """
    data.model(), data.repertoire()  # impossible settings are refused before anything is written
    output_folder(out)
    _claim(out, data.describe())
    wanted = {(u, n): out / name(u, n) for u in range(users) for n in range(sessions)}
    missing = [key for key, path in wanted.items() if not _whole(path)]
    kept = len(wanted) - len(missing)
    if kept:
        say(f"{kept} of {len(wanted)} recordings are there already and are kept")
    jobs = {key: partial(_write, data, wanted[key], *key) for key in missing}
    for done, (_, line, left_s) in enumerate(processes.completed(jobs, workers), 1):
        say(f"{kept + done}/{len(wanted)} {line}; {formatting.duration(left_s)} left")
    return list(wanted.values())


def _write(data: DataSet, path: Path, user: int, number: int) -> str:
    """Simulate a session into its file, and return a line about it."""
    made = data.session(user, number)
    files.atomic_write(path, writer.pack(made), replace=False)
    assert made.truth is not None
    return f"{path.name}: {len(made.frames)} frames, {len(made.truth.events)} touches"


def _claim(out: Path, description: str) -> None:
    """Write the folder's description, or check that it is the same.

    Raises:
        ValueError: It is another one, or recordings are there without any.
    """
    path = out / DESCRIPTION
    if not path.exists():
        if any(out.glob("[!.]*.npz")):
            raise ValueError(f"{out} holds recordings of another origin; choose another --out")
        storage.write_text(path, description)
    elif storage.read_text(path) != description:
        raise ValueError(
            f"{out} holds a data set with other settings ({path}); repeat them, or choose "
            "another --out"
        )


def _whole(path: Path) -> bool:
    """Whether a recording is there; a damaged one is refused rather than replaced."""
    if path.exists() and not zipfile.is_zipfile(path):
        raise ValueError(f"{path} is damaged; remove it, and the same command makes it again")
    return path.exists()
