"""Labels during a recording: from the button, the keys and the cues, for each frame."""
