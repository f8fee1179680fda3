"""HTML reports and Markdown cards of trainings and evaluations. For `training` and `cli`."""
