"""The orb as a standard Bluetooth gamepad and keyboard, for hosts without the `host` program.

Pure: `report_map` (description of the reports), `reports` (held keys as bytes), `host_selection`
(the active host), `gatt_services` and `l2cap` (values and messages over GATT and over classic
Bluetooth). `hid_device` combines them with held keys; `gatt` and `classic` send reports.
"""
