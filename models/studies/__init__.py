"""Experiments beyond training: information, figure 7, sweeps, cross-validation, users."""
