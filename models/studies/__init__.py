"""Experiments beyond training: the paper repeated, and sweeps with cross-validation."""
