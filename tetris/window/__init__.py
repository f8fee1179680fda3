"""The game in a pygame window: screens, menus, themes, sounds."""
