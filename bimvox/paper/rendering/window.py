"""A window that shows pictures of the site, with pygame if it is installed."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.paper.rendering.picture import RENDER_SIZE_PX


class Window:
    """A pygame window. pygame is optional: see :meth:`open`."""

    def __init__(self, pygame: Any, frames_per_second: int) -> None:
        self._pygame = pygame
        self._clock = pygame.time.Clock()
        self._fps = frames_per_second
        self._screen = pygame.display.set_mode(RENDER_SIZE_PX)
        pygame.display.set_caption("bimvox")

    @classmethod
    def open(cls, frames_per_second: int) -> Window | None:
        """Return a window. None if pygame is not installed or there is no display."""
        try:
            pygame = importlib.import_module("pygame")
        except ImportError:
            return None
        try:
            pygame.display.init()
            return cls(pygame, frames_per_second)
        except pygame.error:
            return None

    def show(self, pixels: NDArray[np.uint8]) -> None:
        """Show a picture at the frame rate."""
        self._pygame.event.pump()
        surface = self._pygame.surfarray.make_surface(pixels.swapaxes(0, 1))
        self._screen.blit(surface, (0, 0))
        self._pygame.display.flip()
        self._clock.tick(self._fps)

    def close(self) -> None:
        """Close the window."""
        self._pygame.display.quit()
