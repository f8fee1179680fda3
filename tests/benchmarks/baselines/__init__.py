"""Baseline models that benchmarks compare with."""
