"""The whole program under one name."""

from controller import __version__ as __version__
