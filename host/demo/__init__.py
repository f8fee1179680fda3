"""The demo: a program that plays by gestures, and what it records."""
