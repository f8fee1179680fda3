"""The game in a pygame window: screens, menus, themes, sounds."""

import os

# pygame greets on standard output, which belongs to results.
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
