"""What the game's window shows besides code: a font, and its words in three languages."""
