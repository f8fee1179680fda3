"""Window kit of game and application: menus, themes, languages, keys, settings, sounds."""
