"""Bundle deployment: upload, self-test, installation and rollback."""
