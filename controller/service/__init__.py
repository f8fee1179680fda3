"""The device as a service of systemd: its unit, its heartbeat, and what state it is in."""
