"""Sensors: one module each, found by name, behind the type in `base`."""
