"""The panel beside the game: the dome, the gestures and the state of the orb."""
