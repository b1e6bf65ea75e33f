"""What the viewers of all problems have in common: a canvas, and pictures of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

from cps_envs.core.game.problem import Problem, imported
from cps_envs.core.picture.canvas import Canvas
from cps_envs.core.picture.frame import HEIGHT, WIDTH
from cps_envs.core.picture.history import History
from cps_envs.core.picture.pixels import PixelCanvas
from cps_envs.core.picture.recording import Recorder
from cps_envs.core.types import Array


class CanvasViewer(ABC):
    """Draws scenes of one configuration on a canvas: on one of pixels, unless another is given.

    Raises:
        MissingExtraError: no canvas is given, and pygame is not installed.
    """

    size: ClassVar[tuple[int, int]] = (WIDTH, HEIGHT)  # pixels

    def __init__(self, config: Any, canvas: Canvas | None = None) -> None:
        self._config = config
        self._canvas = PixelCanvas(*self.size) if canvas is None else canvas

    @abstractmethod
    def draw(self, scene: Any) -> None:
        """Draw a scene on the canvas."""

    def frame(self, scene: Any) -> Array:
        """The picture of a scene, uint8 (H, W, 3).

        Raises:
            TypeError: the canvas has no pixels.
        """
        if not isinstance(self._canvas, PixelCanvas):
            raise TypeError(f"{type(self._canvas).__name__} has no pixels: call draw(scene)")
        self.draw(scene)
        return self._canvas.pixels()


class RememberingViewer(CanvasViewer):
    """A viewer whose curves hold the moments of the same episode that it has seen before."""

    moment: ClassVar[Sequence[str]] = ("time_s",)  # fields of a scene, see `History`
    kept: ClassVar[Sequence[str]]  # its other fields that become curves
    most_points: ClassVar[int]  # of a curve

    def __init__(self, config: Any, canvas: Canvas | None = None) -> None:
        super().__init__(config, canvas)
        self._history = History(self.moment, self.kept, self.most_points)

    def watch(self, scene: Any) -> None:
        """Take a moment in without drawing it, so that later curves hold it."""
        self._history.add(scene)


def recording_viewer(problem: Problem, config: Any) -> tuple[CanvasViewer, Recorder] | None:
    """A problem's viewer and the recorder that it draws on; None where it draws in another way, or not at all."""
    if not problem.viewer:
        return None
    viewer: Any = imported(problem.viewer)
    if not (isinstance(viewer, type) and issubclass(viewer, CanvasViewer)):
        return None
    recorder = Recorder(*viewer.size)
    return viewer(config, recorder), recorder
