"""What arbitrary bytes do to us: harnesses for atheris, and for hypothesis in the default tests."""
