"""The device: from capacitance to command."""

__version__ = "0.1.0"  # of the whole program; pyproject.toml reads it here
