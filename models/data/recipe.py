"""Training recipes as plain values: the paper's, and the best known."""

from dataclasses import dataclass, field, replace
from typing import Final

from controller.recognition.images.frames import PreprocessSettings
from controller.recognition.touch_input import TouchInput

# Batches that CNN-3D learns from by the default recipe: a minute. Five times as many classify .3 to
# .4 % more frames rightly (docs/measurements.md, length of a course).
STEPS: Final = 3_000
NEVER_S: Final = 1e9  # thirty years: what begins after so long never does


@dataclass(frozen=True, slots=True)
class Augmentation:
    """Amounts of augmentation of the training examples."""

    # share of examples that are turned by quarters, as far as their gestures declare
    turned: float = 0.2
    mirrored: float = 0.5  # share of examples that are mirrored, as far as their gestures declare
    # greatest distance that windows are shifted in each direction, taxels, as far as their gestures
    # declare
    shifted: int = 1
    gain: float = 0.15  # deviation of the signal's strength, relative
    # deviation of a constant error of each taxel (rest that is not quite true)
    offset: float = 0.004
    noise: float = 0.003  # deviation of white noise of each reading
    dropout: float = 0.15  # probability that an example has dead taxels
    electrode: float = 0.2  # probability that an example has a dead row or column

    @property
    def symmetric(self) -> bool:
        """Whether any example is turned or mirrored."""
        return self.turned > 0.0 or self.mirrored > 0.0


VARIED: Final = Augmentation()
UNTOUCHED: Final = Augmentation(0.0, 0.0, 0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class UserAugmentation:
    """Augmentation of examples of the user network; deviations of normal distributions.

    Symmetries are left out: which hand a user has, and from where it comes, identifies the
    user. What differs from day to day in one user is varied instead, so that the network cannot
    learn one day's values by heart.
    """

    turned: float = 0.14  # of the dome under the hand, radians
    moved: float = 0.15  # of the dome under the hand, grid units along each axis
    wider: float = 0.03  # of the hand's or the dome's size, relative
    tempo: float = 0.06  # of the speed of a gesture, relative
    firm: float = 0.08  # of the signal's strength, relative
    offset: float = 0.004  # of a constant error of each taxel (rest that is not quite true)
    noise: float = 0.003  # of each reading


VARIED_USER: Final = UserAugmentation()
UNVARIED_USER: Final = UserAugmentation(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class NetworkRecipe:
    """Hyperparameters of the training of one network."""

    epochs: int = 0  # passes over the examples; 0: as many as `steps` takes, within `limits`
    steps: int = 0  # batches that are enough
    limits: tuple[int, int] = (1, 1)  # fewest and most epochs that `steps` may come to
    whole: int = 0  # fewest epochs of all examples, however many batches these are
    batch: int = 150  # examples per step
    nesterov: bool = False  # Nesterov's accelerated gradient, momentum 0.9, in place of Adam
    rate: float = 2e-3  # highest learning rate
    falling: bool = True  # it warms up and falls to zero along a cosine; else it stays
    # last share of the batches over which the weights are averaged; 0: the last ones stay
    averaged: float = 0.0
    # penalty on squared weights of convolutions and dense layers
    l2: tuple[float, float] = (5e-4, 1e-5)
    clip: float = 0.0  # greatest norm of a gradient; 0: any
    # share of the null windows that each epoch draws; idling teaches little
    null_share: float = 0.5
    # weight of a class in the loss: its share of the examples to this negative power
    balance: float = 0.5
    label_noise: float = 0.0  # deviation of what is added to each true place, grid units
    # errors beyond this count by their size, not by its square, grid units; 0: none do
    robust: float = 0.0
    # input of CNN-2D; by default the touch image as it is
    touch: TouchInput = field(default_factory=TouchInput)
    channels: tuple[int, int] = (12, 24)  # maps of the convolutions
    hidden: tuple[int, int] = (64, 32)  # widths of the dense layers
    strides: bool = True  # convolutions take longer steps in space and time than the paper's
    normalised: bool = False  # layers are normalised over each batch while they learn
    dropped: float = 0.0  # share of the dense layers' units that each batch is without
    # while it learns, factors of matrix products are rounded to 8 bits on processors that are
    # faster then (bfloat16); sums are not
    coarse: bool = False
    augmentation: Augmentation = VARIED  # augmentation of the examples

    def passes(self, examples: int) -> int:
        """Return how many epochs so many examples get."""
        if self.epochs:
            return self.epochs
        least, most = self.limits
        enough = -(-self.steps * self.batch // max(1, examples))
        return min(most, max(least, self.whole, enough))

    def share(self, examples: float) -> float:
        """Return which share of so many examples an epoch draws, at most.

        It is small enough that `steps` come to the fewest epochs of `limits`, not to more batches.
        """
        if self.epochs or self.whole:
            return 1.0
        return min(1.0, self.steps * self.batch / self.limits[0] / max(1.0, examples))

    def lasting(self, epochs: int) -> "NetworkRecipe":
        """Return the recipe with so many epochs; 0: as many as it has."""
        return replace(self, epochs=epochs or self.epochs)

    def of_people(self, count: int) -> "NetworkRecipe":
        """Return the recipe for recordings of so many people.

        One person's do not show from where others' hands come, so all examples are turned.
        """
        varied = self.augmentation
        if count > 1 or not varied.symmetric:
            return self
        return replace(self, augmentation=replace(varied, turned=1.0))


@dataclass(frozen=True, slots=True)
class Recipe:
    """Training recipe of both networks."""

    name: str  # name of the recipe
    gesture: NetworkRecipe  # CNN-3D
    location: NetworkRecipe  # CNN-2D
    # CNN-2D sees the image of a touch so far (controller/recognition/touch_position.py), not each
    # frame's
    averaged: bool = True
    repair: bool = True  # labels that people gave are moved to where the touch was
    truth: bool = True  # the truth is learned from where it is known; else the label button's
    scaled: bool = True  # probabilities are calibrated on held-out sessions
    # rest is followed while nothing touches; else it is the first ten seconds' mean
    tracked: bool = True

    def settings(self, rate_hz: float, window: int) -> PreprocessSettings:
        """Return the preprocessing settings."""
        plain = PreprocessSettings(rate_hz=rate_hz, window=window)
        if self.tracked:
            return plain
        # Paper, section 4.1: C0 is the mean of the first ten seconds, and stays.
        return replace(plain, start_s=10.0, settle_s=NEVER_S, adopt_s=NEVER_S)

    def sentences(self, *, gesture: bool, location: bool) -> list[str]:
        """Return a description of the trained networks, in sentences."""
        rest = "followed while nothing touches" if self.tracked else "the first ten seconds, fixed"
        lines = [
            f"rest: {rest}",
            f"labels of people: {'moved to the touch' if self.repair else 'as they were given'}",
        ]
        networks = (("CNN-3D", self.gesture, gesture), ("CNN-2D", self.location, location))
        for name, own in ((name, own) for name, own, wanted in networks if wanted):
            much = f"{own.epochs} epochs" if own.epochs else f"{own.steps} steps"
            how = "Nesterov" if own.nesterov else "Adam"
            varied = "no augmentation" if own.augmentation == UNTOUCHED else "augmented"
            maps, dense = ("/".join(map(str, widths)) for widths in (own.channels, own.hidden))
            lines.append(
                f"{name}: {maps} maps, {dense} dense, {how}, {much} of batches of {own.batch}, "
                f"{varied}"
            )
        return lines


DEFAULT: Final = Recipe(
    "default",
    # Normalised layers are as good after 12 epochs as others after 30.
    gesture=NetworkRecipe(
        steps=STEPS,
        limits=(8, 100),
        batch=256,
        rate=1.1e-2,
        channels=(16, 32),
        hidden=(96, 48),
        normalised=True,
        coarse=True,
    ),
    # Images of touches are few and small, so they may come by often; noise would hide the place.
    location=NetworkRecipe(
        steps=2_000,
        limits=(1, 200),
        batch=256,
        rate=6e-3,
        l2=(0.0, 0.0),
        robust=0.03,
        touch=TouchInput(crop=15, level=0.08),
        channels=(16, 24),
        hidden=(64, 32),
        strides=False,
        augmentation=Augmentation(
            turned=0.3, gain=0.05, offset=0.0, noise=0.0, dropout=0.02, electrode=0.01
        ),
    ),
)

# For sessions of `models simulate --unruly`, where a third of the touches are no gestures: what
# tells them apart would be hidden by more noise. Courses are longer, as of the bundle that ships.
PLAY: Final = replace(
    DEFAULT,
    name="play",
    gesture=replace(
        DEFAULT.gesture,
        steps=15_000,
        augmentation=replace(VARIED, offset=0.003, noise=0.002, dropout=0.1, electrode=0.1),
    ),
    location=replace(DEFAULT.location, steps=30_000, limits=(40, 200), rate=3e-3),
)

# For people on other sensors than the orb: few, and unlike each other. A long course learns
# them by heart; a short one with dropout, averaged, needs no temperature. Of many windows two
# epochs learn too little (docs/measurements.md, people on another sensor). Places take the course
# of `play`.
PEOPLE: Final = replace(
    DEFAULT,
    name="people",
    gesture=replace(
        DEFAULT.gesture, steps=300, limits=(1, 1000), whole=6, dropped=0.3, averaged=0.5
    ),
    location=PLAY.location,
    scaled=False,
)

# Paper, section 4.2. Learning rate and widths are not stated: 1e-3 and docs/paper.md's.
PAPER: Final = Recipe(
    "paper",
    gesture=NetworkRecipe(
        epochs=500,
        batch=150,
        rate=1e-3,
        falling=False,
        l2=(5e-4, 1e-5),
        null_share=1.0,
        balance=0.0,
        channels=(16, 32),
        hidden=(128, 64),
        strides=False,
        augmentation=UNTOUCHED,
    ),
    location=NetworkRecipe(
        epochs=2000,
        batch=128,
        nesterov=True,
        rate=1e-3,
        falling=False,
        l2=(1e-5, 5e-6),
        clip=10.0,
        label_noise=0.05,
        channels=(16, 32),
        hidden=(128, 64),
        strides=False,
        augmentation=UNTOUCHED,
    ),
    averaged=False,
    repair=False,
    truth=False,
    scaled=False,
    tracked=False,
)

# The user network: like CNN-3D, but varied only as one user varies.
USER: Final = NetworkRecipe(
    steps=2_400,
    limits=(5, 40),
    batch=128,
    rate=8e-3,
    l2=(1e-4, 1e-4),
    channels=(16, 32),
    hidden=(96, 48),
    normalised=True,
)

RECIPES: Final = {recipe.name: recipe for recipe in (DEFAULT, PLAY, PEOPLE, PAPER)}
