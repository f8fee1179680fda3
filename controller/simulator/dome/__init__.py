"""The dome's physics: membrane, contact, electronics and read-out."""
