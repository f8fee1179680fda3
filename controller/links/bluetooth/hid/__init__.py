"""The orb as a standard Bluetooth gamepad and keyboard, for hosts with nothing of ours installed.

Pure: `report_map` (description of the reports), `reports` (held keys as bytes), `host_selection`
(the active host), `gatt_services` and `l2cap` (what a host reads and writes, over GATT and over
classic Bluetooth). `hid_device` joins them to held keys; `gatt` and `classic` send reports.
"""
