"""The device's side of Bluetooth: BlueZ over D-Bus, profiles and reports."""
