"""Discovery of orbs by their identity, whatever port they are behind.

Nothing is scanned by opening ports. Looked at are only those where an orb has been before, those
whose USB descriptor says that they may be one, and those of bonded Bluetooth devices; any other is
opened when the user asks for it. Each is opened in a process of its own, with a deadline, because
opening, closing and even listing ports can hang for longer than a user waits.
"""
