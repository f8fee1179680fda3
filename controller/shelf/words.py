"""What the commands of the shelf say of a bundle."""

from typing import Final

from controller.bundle import Bundle

_SHIPS: Final = "shipped"  # what people call the bundle without a name


def about(bundle: Bundle) -> str:
    """Return what a bundle knows, and for which sensor."""
    return f"{', '.join(bundle.labels[1:])}; for {sensor(bundle)}"


def sensor(bundle: Bundle) -> str:
    """Return the sensor that a bundle is for."""
    return f"{bundle.rows}×{bundle.columns} taxels at {bundle.rate_hz:g} Hz"


def called(name: str | None) -> str:
    """Return what people call the bundle of a name."""
    return "" if name is None else name or f"the {_SHIPS} bundle"
