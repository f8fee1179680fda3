"""The screens: one file each, moved between by a `tetris.window.screen_stack.ScreenStack`."""
