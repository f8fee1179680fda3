"""Frames to images: baseline, scale, drift, dead taxels, and the sensor's health."""
