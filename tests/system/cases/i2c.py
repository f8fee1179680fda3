"""MPR121 chips on I2C: the kernel's stub is the chip's memory, and this test its electrodes."""

from pathlib import Path

import numpy as np
import smbus2

from controller.sensors import mpr121

from ..guest import Guest

CHIP = 0x5A
WIRING = Path("/tmp/mpr121.toml")
COUNTS = (500, 510, 520, 530, 540, 550, 560, 570, 580, 590, 600, 1023)  # 10 bits, inverse to C


def run(guest: Guest) -> None:
    """Read 26 bytes in one block, then capacitances by the sensor."""
    guest.run("modprobe", "i2c-dev")
    guest.run("modprobe", "i2c-stub", f"chip_addr={CHIP:#x}")
    number = stub()
    with smbus2.SMBus(number) as chip:
        touch(chip, COUNTS)
        block = chip.read_i2c_block_data(CHIP, 0x04, 26)
        guest.check(block[:4] == [0xF4, 0x01, 0xFE, 0x01], f"a block of {len(block)} bytes")
        sensed(guest, chip, number)


def sensed(guest: Guest, chip: smbus2.SMBus, number: int) -> None:
    """See the sensor configure the chip and return C = k / counts."""
    WIRING.write_text(f"bus = {number}\naddresses = [{CHIP}]\nrows = 3\ncolumns = 4\n")
    sensor = mpr121.create(mpr121.Options(wiring=WIRING))
    try:
        guest.check(chip.read_byte_data(CHIP, 0x5E) & 0x0F == 12, "12 electrodes are switched on")
        rest = sensor.read(0.0)
        # AN3889: V = I t / C of a 10-bit converter that ends at the supply, 16 uA and 0.5 us.
        expected = 1024 * 16 * 0.5 / 3.3 / np.array(COUNTS)
        guest.check(np.allclose(rest.ravel(), expected, rtol=1e-6), f"{rest[0, 0]:.2f} pF at rest")
        touch(chip, (450, *COUNTS[1:]))
        change = sensor.read(0.1) - rest
        guest.check(change[0, 0] > 0 and not change.ravel()[1:].any(), "one electrode rises")
    finally:
        sensor.close()


def stub() -> int:
    """Return the number of the stub's bus."""
    for name in Path("/sys/class/i2c-dev").glob("i2c-*/name"):
        if "stub" in name.read_text():
            return int(name.parent.name.removeprefix("i2c-"))
    raise AssertionError("there is no bus of i2c-stub")


def touch(chip: smbus2.SMBus, counts: tuple[int, ...]) -> None:
    """Let the electrodes have counts."""
    for electrode, count in enumerate(counts):
        chip.write_byte_data(CHIP, 0x04 + 2 * electrode, count & 0xFF)
        chip.write_byte_data(CHIP, 0x05 + 2 * electrode, count >> 8)
