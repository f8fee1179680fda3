"""Deployable model packages: format, vocabulary, inference, deployment."""
