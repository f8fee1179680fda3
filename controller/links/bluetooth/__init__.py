"""Bluetooth services of the device, through BlueZ on Linux; needs the extra [bluetooth].

`bluez` is the D-Bus edge, `pairing_agent` confirms pairings, and `registration` is the thread that
registers services, again after bluetoothd or an adapter returns.
"""
