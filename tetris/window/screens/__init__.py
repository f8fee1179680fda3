"""The screens: one file each, moved between by a `tetris.kit.stage.Stage`."""
