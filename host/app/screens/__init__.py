"""Screens about the orb."""
