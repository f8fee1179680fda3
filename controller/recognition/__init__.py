"""Recognition, pure: from frames to commands. NumPy only; no file, clock, thread or socket."""
