"""Defaults that the command lines show before they import what is slow."""

from typing import Final

STEPS: Final = 15_000  # batches that CNN-3D learns from by the default recipe
