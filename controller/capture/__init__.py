"""Labels while a session is recorded: from the button, the keys and the cues, for each frame.

Imports sensors, recordings and recognition; the command line, teaching and the runtime import it.
"""
