"""The protocol of the link and the sessions at its two ends, pure; standard library only."""
