"""A target of one's own for OrbTouch."""
