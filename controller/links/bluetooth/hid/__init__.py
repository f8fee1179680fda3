"""The orb as a standard Bluetooth gamepad and keyboard, for hosts with nothing of ours installed.

Pure: `report_map` (what a host is told of the reports), `reports` (what is down, as bytes),
`mapping` (commands to keys and buttons), `held` (what is down, and until when), `hosts` (who may
have the orb), `services` and `channels` (what a host reads and writes, over GATT and over classic
Bluetooth). `gatt` and `classic` are the edges that bring these to BlueZ.
"""
