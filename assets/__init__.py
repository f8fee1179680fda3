"""Recordings and pictures, read through importlib.resources."""
