"""The device as a Bluetooth one, through BlueZ on Linux; needs the extra [bluetooth].

`names` says who we are, `bluez` is the D-Bus edge, `agent` decides who may pair, `keeper` is the
thread that keeps it all registered while bluetoothd and adapters come and go.
"""
