"""The gestures that ship, one `.toml` file each: docs/gestures.md."""
