"""Emulated hardware: mock pins and a fake converter on a simulated circuit. Needs gpiozero only."""
