"""Evaluation of bundles on recordings, and tuning of their decisions."""
