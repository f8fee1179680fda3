"""Window kit of game and application: menus, themes, languages, keys, settings, sounds."""

import os

# pygame greets on standard output, which belongs to results.
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
