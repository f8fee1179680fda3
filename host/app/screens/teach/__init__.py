"""Pages that teach gestures, users and whole networks."""
