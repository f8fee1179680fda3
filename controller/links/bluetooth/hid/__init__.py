"""The orb as a standard Bluetooth gamepad and keyboard, for hosts without the `host` program.

Pure: `reports` (keys as bytes, and their description), `held_keys`, the selection in `hosts`,
`gatt_services` and `l2cap` (values and messages over GATT and over classic Bluetooth).
`hid_device` combines them with held keys; `gatt` and `classic` send reports.
"""
