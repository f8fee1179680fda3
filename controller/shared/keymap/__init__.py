"""Key names, key mappings, held keys and the keyboard of the terminal; standard library only."""
