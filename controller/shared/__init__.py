"""Ground shared by device and host: protocol, key maps, errors, files, configuration, ports."""
