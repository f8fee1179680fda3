"""Screens about the orb, over those of the game."""
