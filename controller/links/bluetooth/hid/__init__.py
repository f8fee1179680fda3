"""The orb as a standard Bluetooth gamepad and keyboard, for hosts without the `host` program.

Pure: `reports` (held keys as bytes, and their description), the selection in `hosts`, and
`gatt_services` (values). `hid_device` combines them with held keys; `gatt` sends reports.
"""
