"""The programs over real BlueZ and a real kernel, in a virtual machine: python -m tests.system."""
