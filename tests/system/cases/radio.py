"""The test bed itself: two linked adapters that BlueZ drives, and the programs' own imports."""

from ..guest import Guest


def run(guest: Guest) -> None:
    """Start everything, and import what the other cases stand on."""
    guest.radio()
    guest.check(len(set(guest.addresses)) == 2, f"adapters {' and '.join(guest.addresses)}")
    versions = "import numpy, onnxruntime, pygame, serial, dbus_fast; print(numpy.__version__, "
    versions += "onnxruntime.__version__, pygame.version.ver, serial.__version__)"
    words = guest.run("python3", "-c", versions).split()
    guest.saw("numpy {}, onnxruntime {}, pygame-ce {}, pyserial {}".format(*words[-4:]))
    kernel = guest.run("uname", "-r").strip()
    bluez = guest.run("bluetoothctl", "--version").split()[-1]
    guest.saw(f"kernel {kernel}, BlueZ {bluez}")
