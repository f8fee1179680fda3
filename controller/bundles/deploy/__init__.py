"""The bundles of this device: proved, kept, and switched so that there is always one."""
