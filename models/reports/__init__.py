"""The report of a training, a tuning, an evaluation: one HTML file that needs nothing else."""
