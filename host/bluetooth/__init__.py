"""The laptop's side of Bluetooth: rfcomm:// for pyserial, the channel's number, and pairing."""
