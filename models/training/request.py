"""Options of `models train`, from which its command line is made; no PyTorch."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal

from models.data.examples import Choice
from models.data.recipe import RECIPES, Recipe

TaskName = Literal["gesture", "location", "user", "contact", "state", ""]

PLACE_EPOCHS: Final = 4  # epochs of CNN-2D for each of CNN-3D, if a number is given
SIMULATED: Final = ("contact", "state")  # tasks without recordings
FOLDERS: Final = {"type": Path, "nargs": "+"}


def _option(default: Any, words: str, metavar: str = "", **how: Any) -> Any:
    """Return a field that is an option; `words` are its help, `how` is as argparse has it."""
    if metavar:
        how["metavar"] = metavar
    if isinstance(default, bool):
        how["action"] = "store_false" if default else "store_true"
    return field(default=default, metadata={"help": words, **how})


@dataclass(frozen=True, slots=True)
class Request:
    """Options of `models train`; what each means is the help beside it."""

    paths: tuple[Path, ...]
    out: Path
    task: TaskName = _option(
        "",
        "what to train (default: gestures, and places if the recordings have them); user: the user "
        "network, from recordings of several people on several days (orbtouch docs users); "
        "contact: how wide a contact is, so that no elbow is answered, simulated, without "
        "DIR; state: place, depth, number and angle of the fingers in each frame, as contact",
        choices=("gesture", "location", "user", "contact", "state"),
    )
    recipe: str = _option(
        "",
        "default; play, for sessions with many touches that are no gestures, as the bundle that "
        "ships; people, for other sensors; or the paper's section 4.2 to the letter (default: "
        "people for recordings in other units than pF, else default)",
        choices=tuple(RECIPES),
    )
    labels: Choice = "auto"  # this and the next three are options of `models.cli._options.SHARED`
    every: bool = False
    window: int = 0
    seed: int = 0
    split: str = _option(
        "",
        "hold out sessions, users, or the ends of sessions: session, user, time "
        "(default: session, or time for fewer than four)",
        "BY",
    )
    base: Path | None = _option(
        None,
        "bundle of the network that is not trained, or that users are added to (default: the one "
        "that ships)",
        "BUNDLE",
        flag="with",
        type=Path,
    )
    start: Path | None = _option(
        None,
        "bundle of the same sensor and rate whose networks the training starts from. It helps with "
        "recordings of few people, or a few epochs (orbtouch docs training; default: random)",
        "BUNDLE",
        flag="from",
        type=Path,
    )
    epochs: int | None = _option(
        None,
        "passes of CNN-3D over the examples, of CNN-2D four times as many (default: the recipe's); "
        "0, with --from: keep its networks, and choose anew when a gesture counts",
        "N",
        range=(0, 100_000),
    )
    gestures: tuple[str, ...] = _option(
        (),
        "with --task user: gestures that identify users, such as twist_cw,twist_ccw (default: all)",
        "LABELS",
        type=lambda text: tuple(filter(None, text.split(","))),
    )
    auxiliary: tuple[Path, ...] = _option(
        (),
        "with --task gesture: recordings with more gestures, which are learned beside the others "
        "and are no answers in the end, so that a new gesture is taught from fewer examples",
        "DIR",
        **FOLDERS,
    )
    others: tuple[Path, ...] = _option(
        (),
        "with --task user: recordings of people who are not enrolled, strangers",
        "DIR",
        **FOLDERS,
    )
    declared: bool = _option(
        False,
        "try no symmetries beside those in gestures.toml; else, on another sensor than the orb, "
        "those that help people held out are used (orbtouch docs people)",
    )
    command: str = ""  # as it was typed

    def check(self) -> None:
        """Raise ValueError for options of another task."""
        if self.task in SIMULATED:
            alone = Request((), self.out, self.task, seed=self.seed, base=self.base)
            if self != replace(alone, epochs=self.epochs, command=self.command):
                raise ValueError(
                    f"--task {self.task} takes --with, --seed and --epochs: contacts are simulated"
                )
            return
        if not self.paths:
            raise ValueError("there is nothing to learn from; name folders of recordings, DIR")
        if self.epochs == 0 and self.start is None:
            raise ValueError(
                "--epochs 0 trains nothing; add --from BUNDLE to choose its thresholds"
            )
        if self.task != "user":
            if self.others or self.gestures:
                raise ValueError("--others and --gestures are for people; add --task user")
            return
        flags = {"window": "window", "split": "split", "auxiliary": "auxiliary", "start": "from"}
        for name, flag in flags.items():
            if getattr(self, name):
                raise ValueError(f"--{flag} is not for people; leave it out")
        if self.recipe:
            raise ValueError("there is one recipe for people; leave --recipe out")

    def networks(self, *, orb: bool = True) -> Recipe:
        """Return the networks' recipe for the orb or another sensor, with the epochs given."""
        recipe = RECIPES[self.recipe or ("default" if orb else "people")]
        return replace(
            recipe,
            gesture=recipe.gesture.lasting(self.epochs or 0),
            location=recipe.location.lasting(PLACE_EPOCHS * (self.epochs or 0)),
        )
