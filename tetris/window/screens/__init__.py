"""The screens: one file each, moved between by a `tetris.window.stage.Stage`."""
