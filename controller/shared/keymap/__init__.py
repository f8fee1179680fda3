"""Key names, key mappings and held keys; standard library only."""
