"""BlueZ over D-Bus, for both ends: devices, adapters and pairing."""
