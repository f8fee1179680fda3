"""Injection of keys into other programs, behind a watchdog process. For `targets`."""
