"""Descriptions of bundles for the commands that install and list them."""

from typing import Final

from controller.bundles.bundle import Bundle

_SHIPS: Final = "shipped"  # what people call the bundle without a name


def about(bundle: Bundle) -> str:
    """Return what a bundle knows, and for which sensor."""
    return f"{', '.join(bundle.labels[1:])}; for {sensor(bundle)}"


def sensor(bundle: Bundle, *, pitch: bool = False) -> str:
    """Return the sensor that a bundle is for, its pitch where that is asked for."""
    apart = f", {bundle.pitch_mm:g} mm apart," if pitch else ""
    return f"{bundle.rows}×{bundle.columns} taxels{apart} at {bundle.rate_hz:g} Hz"


def called(name: str | None) -> str:
    """Return what people call the bundle of a name."""
    return "" if name is None else name or f"the {_SHIPS} bundle"
