"""The construction site as Gymnasium environments with pictures; ``bimvox.env.gym`` registers them.

All take the arguments of :class:`bimvox.paper.env.site_env.PaperSiteEnv`; ``gymnasium.make_vec`` steps them in one
compiled kernel, with the arguments of :class:`bimvox.paper.env.vector_env.PaperVectorEnv`.
"""

from __future__ import annotations

import importlib
import os
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.env.gym import PAPER_ENV_IDS, register
from bimvox.paper.env.ansi import ansi_picture
from bimvox.paper.env.picture import SitePicture
from bimvox.paper.env.site_env import PaperSiteEnv
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.env.vector_env import PaperVectorEnv
from bimvox.paper.rendering.picture import paper_site_pixels

__all__ = ["PAPER_ENV_IDS", "RENDER_SIZE_PX", "DrawnPaperSiteEnv", "DrawnPaperVectorEnv", "register"]

RENDER_SIZE_PX = (640, 480)


class DrawnPaperSiteEnv(PaperSiteEnv):
    """The construction site with all render modes.

    ``rgb_array`` gives a (480, 640, 3) uint8 picture, ``ansi`` coloured text. ``human`` shows the picture in a window
    if pygame is installed and there is a display; otherwise it prints the text, coloured on a terminal. It does so at
    every ``reset`` and ``step``, as Gymnasium's own environments do.

    Args:
        site: See :class:`PaperSiteEnv`.
        render_mode: None, ``human``, ``rgb_array`` or ``ansi``.
        **more: See :class:`PaperSiteEnv`.
    """

    metadata = {"render_modes": ["human", "rgb_array", "ansi"], "render_fps": 4}  # noqa: RUF012  (as Gymnasium does)

    def __init__(self, site: PaperSpec | str = "paper", *, render_mode: str | None = None, **more: Any) -> None:
        super().__init__(site, render_mode=render_mode, **more)
        self._window = _Window.open(self.metadata["render_fps"]) if render_mode == "human" else None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode."""
        result = super().reset(seed=seed, options=options)
        if self.render_mode == "human":
            self.render()
        return result

    def step(self, action: np.int64) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Take one action."""
        result = super().step(action)
        if self.render_mode == "human":
            self.render()
        return result

    def render(self) -> Any:
        """Draw the running episode in the form of the render mode."""
        if self.render_mode == "rgb_array":
            return paper_site_pixels(self.picture(), RENDER_SIZE_PX)
        if self.render_mode != "human":
            return super().render()
        if self._window is not None:
            self._window.show(paper_site_pixels(self.picture(), RENDER_SIZE_PX))
        else:
            coloured = sys.stdout.isatty() and "NO_COLOR" not in os.environ
            sys.stdout.write(ansi_picture(self.picture(), coloured=coloured))
        return None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None
        super().close()


class DrawnPaperVectorEnv(PaperVectorEnv):
    """The batched construction sites with the render modes ``rgb_array`` and ``ansi``: one picture per site."""

    metadata: dict[str, Any] = {  # noqa: RUF012  (Gymnasium's own convention)
        **PaperVectorEnv.metadata,
        "render_modes": ["rgb_array", "ansi"],
    }

    def draw(self, picture: SitePicture) -> Any:
        """Return a picture in the form of the render mode."""
        return paper_site_pixels(picture, RENDER_SIZE_PX) if self.render_mode == "rgb_array" else super().draw(picture)


class _Window:
    """A pygame window. pygame is optional: see :meth:`open`."""

    def __init__(self, pygame: Any, frames_per_second: int) -> None:
        self._pygame = pygame
        self._clock = pygame.time.Clock()
        self._fps = frames_per_second
        self._screen = pygame.display.set_mode(RENDER_SIZE_PX)
        pygame.display.set_caption("bimvox")

    @classmethod
    def open(cls, frames_per_second: int) -> _Window | None:
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
