"""One file a case: `run(guest)`, which fails by raising."""
