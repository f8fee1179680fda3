"""Bluetooth identifiers that both ends and BlueZ must agree on."""

from typing import Final

# Our own service, so that no other program that offers a serial port is taken for an orb.
SERVICE_UUID: Final = "6f726274-6f75-4368-9c1e-5a0d3f6b2a71"
# The standard one for serial ports, by which Windows and macOS decide to make an ordinary port.
SERIAL_PORT_UUID: Final = "00001101-0000-1000-8000-00805f9b34fb"
# A record that we write ourselves must name its RFCOMM channel, 1 to 30. High ones are seldom
# taken: BlueZ's own profiles have 9 to 17.
CHANNEL: Final = 22
ALIAS: Final = "OrbTouch"

AGENT_PATH: Final = "/orbtouch/agent"
SERIAL_PATH: Final = "/orbtouch/serial"


def record(channel: int = CHANNEL) -> str:
    """Return the service record as BlueZ takes it: XML, attribute numbers of the SDP standard.

    Args:
        channel: The RFCOMM channel that it names, 1 to 30.
    """
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<record>
  <attribute id="0x0001"> <!-- what it is: ours first, then any serial port -->
    <sequence><uuid value="{SERVICE_UUID}"/><uuid value="0x1101"/></sequence>
  </attribute>
  <attribute id="0x0004"> <!-- how to reach it: L2CAP, then RFCOMM on this channel -->
    <sequence>
      <sequence><uuid value="0x0100"/></sequence>
      <sequence><uuid value="0x0003"/><uint8 value="0x{channel:02x}"/></sequence>
    </sequence>
  </attribute>
  <attribute id="0x0005"> <!-- found by browsing -->
    <sequence><uuid value="0x1002"/></sequence>
  </attribute>
  <attribute id="0x0009"> <!-- serial port profile, version 1.2 -->
    <sequence><sequence><uuid value="0x1101"/><uint16 value="0x0102"/></sequence></sequence>
  </attribute>
  <attribute id="0x0100"><text value="{ALIAS}"/></attribute>
</record>
"""
