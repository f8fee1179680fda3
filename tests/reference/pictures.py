"""Draw the pictures of docs/simulator.md.

python -m tests.reference.pictures [--out docs/pictures]
"""

import argparse
import sys
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from controller.shared.aliases import Array, Complex
from controller.simulator.dome import membrane
from controller.simulator.dome.contact import ContactModel, FingerGroup, Fingers, Skin
from tests.reference import paper_model

from .dome import Dome
from .material import UNIT_PA

CORAL, BLUE, INK, DIM, LINE = "#ff8a5c", "#3b82d6", "#1e2535", "#8c96ae", "#dfe3ec"
SIGNED = LinearSegmentedColormap.from_list(
    "signed", ["#174a8c", BLUE, "#b9d8f5", "#ffffff", "#ffd3c0", CORAL, "#b8431a"]
)
STYLE: Final[dict[Any, Any]] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": DIM,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "xtick.color": DIM,
    "ytick.color": DIM,
    "legend.frameon": False,
    "svg.hashsalt": "orbtouch",
    "savefig.dpi": 130,
    "savefig.facecolor": "white",
}

INFLATED = membrane.inflate()
SKIN = Skin(INFLATED, 5, 5, 10.0, ContactModel())
VOLUME = float(-np.trapezoid(np.pi * INFLATED.radius**2, INFLATED.height))
DEPTHS_MM = np.linspace(0.0, 12.0, 49)


def grip(z: Complex, depth_mm: float, drag_mm: Complex) -> FingerGroup:
    """Fingers of 7 mm on the unit disc."""
    depth, radius = np.full((2, 1, len(z)), [[[depth_mm]], [[7.0]]])
    return SKIN.grips(Fingers(z[None], depth, radius, drag_mm[None]))[0]


def feel(z: Complex, depth_mm: float, drag_mm: Complex) -> Array:
    """What the model's taxels sense, ln C / C0, (25,)."""
    if depth_mm <= 0.0:
        return np.zeros(25)
    log_c: Array = SKIN.log_capacitance(grip(z, depth_mm, drag_mm), np.zeros(1))[0]
    return log_c


def pressing(place: complex) -> tuple[Array, Array]:
    """Model and reference, ln C / C0 of every taxel over DEPTHS_MM, (depths, 25) each."""
    ours = [feel(np.array([place]), float(depth), np.zeros(1, complex)) for depth in DEPTHS_MM]
    done = Dome(24, VOLUME, 100 * VOLUME, place, 1.6).press([place], np.arange(0.5, 17, 0.5))
    theirs = [done.at(float(depth)) for depth in DEPTHS_MM]
    return np.array(ours), np.array(theirs)


def comparison(folder: Path) -> None:
    """Model against reference: curves, and where the worst taxel is."""
    figure, axes = plt.subplots(2, 2, figsize=(8.4, 6.4), height_ratios=[2.4, 1], sharex=True)
    cases = (
        (
            "A press on the apex",
            0j,
            ((12, "under the finger"), (13, "10 mm off"), (14, "20 mm off")),
        ),
        (
            "A press at half the radius",
            0.5 + 0j,
            ((14, "1 mm off"), (13, "9 mm off"), (12, "19 mm off"), (10, "39 mm off")),
        ),
    )
    shades = [INK, BLUE, CORAL, DIM]
    for column, (title, place, taxels) in enumerate(cases):
        ours, theirs = pressing(place)
        top, low = axes[:, column]
        for (taxel, name), shade in zip(taxels, shades, strict=False):
            top.plot(DEPTHS_MM, ours[:, taxel], color=shade, lw=2.0, label=name)
            top.plot(DEPTHS_MM[::4], theirs[::4, taxel], "o", mfc="white", mec=shade, ms=5)
        top.axhline(0.0, color=LINE, lw=0.8, zorder=0)
        top.set_title(title)
        top.legend(title="taxel", loc="lower left", alignment="left")
        peak = np.maximum(np.abs(theirs).max(axis=1), 1e-9)
        worst = np.abs(ours - theirs).max(axis=1) / peak
        mean = np.abs((ours - theirs).mean(axis=1)) / peak
        bound = np.interp(DEPTHS_MM, [6.0, 12.0], [15.0, 30.0])
        low.fill_between(DEPTHS_MM[2:], bound[2:], 36.0, color="#ffece3", lw=0, zorder=0)
        low.plot(DEPTHS_MM[2:], 100 * worst[2:], color=CORAL, lw=1.8, label="worst taxel")
        low.plot(DEPTHS_MM[2:], 100 * mean[2:], color=BLUE, lw=1.8, label="mean of all")
        low.set(ylim=(0, 36), xlim=(0, 12.2), xlabel="indentation, mm", xticks=range(0, 13, 2))
        low.legend(loc="upper left", ncols=2)
    axes[0, 0].set_ylabel("ln C / C₀")
    axes[1, 0].set_ylabel("off by, % of peak")
    axes[0, 0].set_ylim(-0.36, 0.02)
    axes[0, 1].set_ylim(-0.36, 0.02)
    axes[0, 1].text(
        12, -0.0, "lines: model    circles: reference", ha="right", va="bottom", color=DIM
    )
    save(figure, folder / "comparison.svg")


def inflation(folder: Path) -> None:
    """The inflated dome, and figure 5b."""
    figure, (left, middle, right) = plt.subplots(
        1, 3, figsize=(10.4, 3.5), width_ratios=[1.35, 1, 1.1]
    )
    stretches = np.r_[1.002, np.linspace(1.01, 3.2, 90)]
    kpa = np.array([membrane.inflate(float(s)).pressure for s in stretches]) * UNIT_PA / 1000
    holds = stretches <= 2.196
    for pressure in (250, 1000, 2000, 2160, 2400, 2470):
        dome = membrane.inflate(float(np.interp(pressure / 1000, kpa[holds], stretches[holds])))
        now = pressure == 2160
        shape = 38 * np.stack(
            [np.r_[-dome.radius[::-1], dome.radius], np.r_[dome.height[::-1], dome.height]]
        )
        left.plot(
            *shape, color=CORAL if now else BLUE, lw=2.4 if now else 1.0, alpha=1 if now else 0.75
        )
        if pressure != 2000:
            left.text(
                0,
                shape[1].max() + 0.6,
                f"{pressure / 1000:g} kPa",
                ha="center",
                color=CORAL if now else BLUE,
                fontsize=8,
            )
    left.set(
        xlabel="mm",
        title="The dome at pressures of the pump",
        ylim=(0, 50),
        yticks=range(0, 60, 10),
    )
    left.set_aspect("equal", adjustable="datalim")
    middle.plot(stretches[holds], kpa[holds], color=BLUE, lw=2)
    middle.plot(stretches[~holds], kpa[~holds], color=DIM, lw=1.4, ls=":")
    middle.plot(1.5, membrane.inflate(1.5).pressure * UNIT_PA / 1000, "o", color=CORAL, ms=7)
    middle.plot(2.196, kpa.max(), "o", mfc="white", mec=BLUE, ms=6)
    middle.annotate("working point", (1.5, 2.16), (1.62, 1.75), color=CORAL)
    middle.annotate("limit point, 2.47 kPa", (2.196, 2.47), (2.0, 2.56), color=BLUE)
    middle.set(
        xlabel="stretch of the apex",
        ylabel="pressure, kPa",
        title="What the pump can hold",
        ylim=(0, 2.75),
    )
    _figure_5b(right)
    save(figure, folder / "inflation.svg")


def _figure_5b(axes: Axes) -> None:
    """C / C0 of 25 taxels against the paper's l^4 of the deflection, eq. (3)."""
    stretches = np.linspace(1.02, 1.75, 60)
    domes = [membrane.inflate(float(s)) for s in stretches]
    predicted = np.array(
        [float(paper_model.capacitance_of_deflection(d.height[:1])[0]) for d in domes]
    )
    x, y = np.meshgrid(np.arange(-2, 3) * 10 / 38, np.arange(-2, 3) * 10 / 38)
    distance = np.hypot(x, y).ravel()
    drop = SKIN.model.permittivity_drop
    grown = np.array([np.interp(distance, d.reference, d.area_ratio) for d in domes])
    ratio = paper_model.capacitance_of_stretch(np.sqrt(grown))
    for k in np.argsort(-distance):
        shade = LinearSegmentedColormap.from_list("", ["#1f5fae", "#cfe3f8"])(
            distance[k] / distance.max()
        )
        axes.plot(predicted, ratio[:, k], color=shade, lw=1.0)
    axes.plot([1, 4], [1, 4], color=INK, lw=1.2, ls="--", label="eq. (3)")
    axes.plot(predicted, ratio.mean(axis=1), color=CORAL, lw=2.4, label="mean of 25 taxels, solved")
    softened = (ratio * (1 - drop * (grown - 1))).mean(axis=1)
    axes.plot(predicted, softened, color=CORAL, lw=1.6, ls=":", label="and permittivity falls")
    axes.text(2.72, 4.3, "apex", color="#1f5fae", ha="right")
    axes.text(3.7, 2.45, "corners", color="#8fb6e3", ha="right")
    axes.axvline(3.02, color=LINE, lw=1.0, zorder=0)
    axes.text(2.98, 1.1, "working point", color=DIM, fontsize=8, ha="right")
    axes.set(
        xlim=(1, 3.75),
        ylim=(1, 7),
        xlabel="λ⁴ of the deflection, eq. (3)",
        ylabel="C / C₀",
        title="Figure 5b",
    )
    axes.legend(loc="upper left", fontsize=8)


def touched(folder: Path) -> None:
    """What taxels sense under a press, a pinch and twists."""
    ray = np.exp(1j * np.radians([193.0, -20.0, 13.0, 46.0])).astype(np.complex128)
    hand = 0.47 * ray  # a thumb and three
    cases = (
        ("press", np.array([0.18 + 0.12j]), 10.0, np.zeros(1, complex)),
        ("pinch", np.array([-0.3 + 0j, 0.3 + 0j]), 7.0, np.array([3.0, -3.0 + 0j])),
        ("twist, counterclockwise", hand, 6.0, 3j * ray),
        ("twist, clockwise", hand, 6.0, -3j * ray),
    )
    figure, row = plt.subplots(1, 4, figsize=(11.4, 3.2))
    for axes, (title, z, depth, drag) in zip(row, cases, strict=True):
        image(axes, feel(z, depth, drag), 0.5)
        x, y = 2 + 3.8 * z.real, 2 - 3.8 * z.imag  # of the fingers, in taxels
        axes.quiver(x, y, drag.real, drag.imag, color=INK, scale=24)
        axes.plot(x, y, "o", mfc="none", mec=INK, ms=22)
        axes.set_title(title, loc="center")
    save(figure, folder / "touched.svg")


def image(axes: Axes, log_c: Array, limit: float) -> None:
    """A 5 x 5 image with its values in percent of C0."""
    axes.imshow(log_c.reshape(5, 5), cmap=SIGNED, vmin=-limit, vmax=limit)
    for (row, column), value in np.ndenumerate(np.expm1(log_c).reshape(5, 5) * 100):
        ink = "white" if abs(log_c[5 * row + column]) > 0.55 * limit else INK
        axes.text(column, row, f"{value:+.0f}", ha="center", va="center", fontsize=8, color=ink)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)


def save(figure: Figure, path: Path) -> None:
    figure.tight_layout()
    figure.savefig(
        path, bbox_inches="tight", metadata={"Date": None} if path.suffix == ".svg" else None
    )
    plt.close(figure)
    print(path, file=sys.stderr)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"), help="folder to write")
    folder: Path = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    mpl.use("agg")
    with plt.rc_context(STYLE):
        for draw in (inflation, comparison, touched):
            draw(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
