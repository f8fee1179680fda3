"""Files of the laptop's window."""
