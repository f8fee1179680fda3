"""Plain result types, below everything that fills or shows them."""
