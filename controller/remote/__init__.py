"""Requests of a host to a running device: teaching, bundle updates, checks, recordings."""
