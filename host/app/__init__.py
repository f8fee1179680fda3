"""The window of the product: the game's screens, and the dome of the orb docked beside them."""
