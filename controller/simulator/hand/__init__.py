"""The simulated hand: gestures as data, users, and scripts of sessions."""
