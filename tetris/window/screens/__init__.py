"""The screens: one file each, moved between by a `tetris.kit.screen_stack.ScreenStack`."""
