"""Labels while a session is recorded: what the button, the keys and the cues say of each frame.

`strokes` and `keys` turn a terminal's bytes into labels, `plan` and `cues` ask for examples, and
`labeller` joins them. They are pure; `terminal` alone knows the keyboard and `status` the screen.
"""
