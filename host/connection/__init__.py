"""The connection to an orb: ports, receiver thread, known devices, bundle uploads."""
