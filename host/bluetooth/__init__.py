"""Bluetooth on the laptop: rfcomm:// for pyserial, channel numbers, pairing. For `cli`."""
