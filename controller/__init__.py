"""The device: from capacitance to command."""
