"""Pictures of an environment: frames as arrays without a display, and a window for people."""

from __future__ import annotations

import os
from typing import Any

import gymnasium

from cps_envs.core.errors import ConfigurationError, require, shown
from cps_envs.core.game.game import Game
from cps_envs.core.game.problem import Problem
from cps_envs.core.types import Array

RENDER_MODES = ["rgb_array", "human"]
FRAMES_PER_SECOND = 10
HIDDEN_DRIVERS = ("dummy", "offscreen")  # what SDL falls back on where there is no display


def check_render_mode(mode: str | None) -> None:
    """Raise ConfigurationError for a mode that is not offered."""
    if mode is not None and not (isinstance(mode, str) and mode in RENDER_MODES):
        raise ConfigurationError(
            f"render_mode = {shown(mode)} is not one of None, {', '.join(map(repr, RENDER_MODES))}"
        )


class Renderer:
    """Draws environments of a game with its problem's viewer, which is made when the first frame is asked for.

    Another `viewer` may be given, such as one that records. A copy has no window, and makes a viewer anew that is none
    of ours, as it may hold what cannot be copied.
    """

    def __init__(self, problem: Problem, game: Game, viewer: Any = None) -> None:
        self._problem, self._game = problem, game
        self._viewer, self._given = viewer, viewer is not None
        self._window: Window | None = None

    def __getstate__(self) -> dict[str, Any]:
        from cps_envs.core.picture.viewer import CanvasViewer  # draws with what an environment needs only to render

        kept = self._given or isinstance(self._viewer, CanvasViewer)
        return {**vars(self), "_window": None, "_viewer": self._viewer if kept else None}

    @property
    def viewer(self) -> Any:
        """The problem's viewer."""
        if self._viewer is None:
            self._viewer = self._problem.make_viewer(self._game.config)
        return self._viewer

    @property
    def remembers(self) -> bool:
        """Whether the viewer draws the course of the episode, and so should `watch` every game step."""
        return hasattr(self.viewer, "watch")

    def watch(self, b: int = 0) -> None:
        """Show a moment to a viewer that remembers, without drawing it."""
        self.viewer.watch(self._game.scene(b))

    def draw(self, b: int = 0) -> None:
        """Draw an environment on the canvas of a `CanvasViewer`."""
        self.viewer.draw(self._game.scene(b))

    def frame(self, b: int = 0) -> Array:
        """The picture of an environment as uint8 (H, W, 3)."""
        frame: Array = self.viewer.frame(self._game.scene(b))
        return frame

    def show(self, b: int = 0) -> None:
        """Put the picture of an environment on the screen."""
        if self._window is None:
            self._window = Window(f"cps_envs {self._problem.name}")
        self._window.show(self.frame(b))

    @property
    def hidden(self) -> bool:
        """Whether frames are shown in a window that nobody sees."""
        return self._window is not None and self._window.hidden

    def render(self, mode: str | None) -> Array | None:
        """What `Env.render` returns in a mode."""
        if mode == "rgb_array":
            return self.frame()
        if mode == "human":
            self.show()
        return None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None


class Window:
    """A pygame window that shows frames at the environments' frame rate."""

    def __init__(self, title: str) -> None:
        self._pygame: Any = require("pygame", extra="render", purpose="drawing on the screen")
        self._title = title
        self._screen: Any = None
        self._clock: Any = None

    def show(self, frame: Array) -> None:
        """Display a frame, uint8 (H, W, 3), and wait for its turn."""
        pygame = self._pygame
        if self._screen is None:
            pygame.display.init()
            if self.hidden:
                gymnasium.logger.warn("there is no display to open a window on: frames are drawn, but nobody sees them")
            self._screen = pygame.display.set_mode((frame.shape[1], frame.shape[0]))
            pygame.display.set_caption(self._title)
            self._clock = pygame.time.Clock()
        pygame.surfarray.blit_array(self._screen, frame.swapaxes(0, 1))
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(FRAMES_PER_SECOND)

    @property
    def hidden(self) -> bool:
        """Whether SDL found no display and draws off screen, though that was not asked for."""
        driver = self._pygame.display.get_driver()
        return driver in HIDDEN_DRIVERS and os.environ.get("SDL_VIDEODRIVER") != driver

    def close(self) -> None:
        """Close the window."""
        if self._screen is not None:
            self._pygame.display.quit()
            self._screen = None
