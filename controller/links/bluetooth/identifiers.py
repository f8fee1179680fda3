"""Bluetooth identifiers shared by the device, the host and BlueZ."""

from typing import Final

# The orb's own service, which distinguishes it from other serial ports.
SERVICE_UUID: Final = "6f726274-6f75-4368-9c1e-5a0d3f6b2a71"
# The standard serial port service, for which Windows and macOS create an ordinary port.
SERIAL_PORT_UUID: Final = "00001101-0000-1000-8000-00805f9b34fb"
# A custom service record must name its RFCOMM channel, 1 to 30; BlueZ's own profiles have 9 to 17.
CHANNEL: Final = 22
ALIAS: Final = "OrbTouch"

AGENT_PATH: Final = "/orbtouch/agent"
SERIAL_PATH: Final = "/orbtouch/serial"


def record(channel: int = CHANNEL) -> str:
    """Return the SDP service record in BlueZ's XML, for an RFCOMM channel, 1 to 30."""
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<record>
  <attribute id="0x0001"> <!-- service classes: the orb's, then serial port -->
    <sequence><uuid value="{SERVICE_UUID}"/><uuid value="0x1101"/></sequence>
  </attribute>
  <attribute id="0x0004"> <!-- protocols: L2CAP, then RFCOMM on this channel -->
    <sequence>
      <sequence><uuid value="0x0100"/></sequence>
      <sequence><uuid value="0x0003"/><uint8 value="0x{channel:02x}"/></sequence>
    </sequence>
  </attribute>
  <attribute id="0x0005"> <!-- public browse group -->
    <sequence><uuid value="0x1002"/></sequence>
  </attribute>
  <attribute id="0x0009"> <!-- serial port profile, version 1.2 -->
    <sequence><sequence><uuid value="0x1101"/><uint16 value="0x0102"/></sequence></sequence>
  </attribute>
  <attribute id="0x0100"><text value="{ALIAS}"/></attribute>
</record>
"""
