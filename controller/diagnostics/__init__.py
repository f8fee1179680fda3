"""`controller doctor`: what is wrong with the machine, the wiring and the skin, and what to do."""
