"""Bundle deployment: upload, self-test, and installation."""
