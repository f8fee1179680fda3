"""What device and host share: protocol, key maps, errors, files, configuration and ports."""
