"""Deployable model packages: format, vocabulary, inference, deployment.

For everything above recognition.
"""
