"""Opening of the window, with one sentence for every reason why there is none."""

import os
import tempfile
import warnings

import pygame

from tetris.kit.theme import DARK

_UNSEEN = {"dummy", "offscreen"}  # drivers that SDL takes quietly where there is no display
_CHOICES = ("SDL_VIDEODRIVER", "SDL_VIDEO_DRIVER")


class DisplayError(RuntimeError):
    """No window can be opened here; the message says why, not what to do instead."""


def open_window(size: tuple[int, int], caption: str) -> pygame.Surface:
    """Open a resizable window and return its surface.

    An unseen driver is accepted when the user's environment names it (SDL_VIDEODRIVER).

    Raises:
        DisplayError: There is no display.
    """
    for system in ("X11", "WAYLAND"):  # the name by which desktops group windows
        os.environ[f"SDL_VIDEO_{system}_WMCLASS"] = caption.lower()  # pygame set the program's
    try:
        # Where it is unset, libwayland would grumble on standard error.
        os.environ.setdefault("XDG_RUNTIME_DIR", tempfile.gettempdir())
        pygame.display.init()
        driver = pygame.display.get_driver()
        if driver in _UNSEEN and not any(os.environ.get(name) for name in _CHOICES):
            pygame.display.quit()
            raise DisplayError("no display was found")
        if driver == "x11":  # a texture costs 40 times the CPU time where OpenGL is emulated
            os.environ.setdefault("SDL_FRAMEBUFFER_ACCELERATION", "0")
        surface = set_size(size)
    except pygame.error as error:
        raise DisplayError(f"the display cannot be opened: {error}") from error
    pygame.font.init()
    pygame.display.set_caption(caption)
    return surface


def show_icon(surface: pygame.Surface, icon: pygame.Surface) -> None:
    """Set the window's icon, and show it in the middle until there is a first picture."""
    pygame.display.set_icon(icon)
    surface.fill(DARK.background)
    surface.blit(icon, icon.get_rect(center=surface.get_rect().center))
    pygame.display.flip()


def set_fullscreen(full: bool, size: tuple[int, int]) -> pygame.Surface:
    """Fill the screen, or go back to a window; pygame's own toggle does nothing on Wayland."""
    if full:
        return pygame.display.set_mode((0, 0), pygame.FULLSCREEN)
    return set_size(size)


def set_size(size: tuple[int, int]) -> pygame.Surface:
    """Ask for a window of another size; the system may give one of its own choice."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # which is what pygame says of that
        return pygame.display.set_mode(size, pygame.RESIZABLE)
