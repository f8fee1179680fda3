"""The demo: a bot that plays with the virtual orb's own hand, and its scores."""
