"""Who touches: a network that tells people apart by their gestures, and what that is worth."""
