"""Figure 7 of the paper, measured anew: what both recipes are worth, and by whose protocol."""
