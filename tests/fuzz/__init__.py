"""Fuzzing with arbitrary bytes: harnesses for atheris, and for hypothesis in the default tests."""
