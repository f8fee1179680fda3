"""Helpers of the tests: simulated devices, hosts, links and disks, and files made for tests."""

from pathlib import Path

SUPPORT = Path(__file__).parent
ROOT = SUPPORT.parents[1]  # of the repository
