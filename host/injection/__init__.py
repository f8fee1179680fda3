"""From commands to keys: what a mapping names is pressed in the program that has the focus."""
