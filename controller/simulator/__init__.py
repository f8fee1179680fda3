"""The virtual orb: membrane, contact, read-out, hand and session."""
