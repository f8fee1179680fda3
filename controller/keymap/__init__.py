"""Key names, key mappings and the state of held keys, pure; standard library only."""
