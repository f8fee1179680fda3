"""Checks of computer, wiring, skin and link, and calibration. For `cli`."""
