"""Many trainings from one description, on this machine's cores or a cluster's (docs/sweeps.md)."""
