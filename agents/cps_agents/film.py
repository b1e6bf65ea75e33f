"""An episode shown: on the screen, as a film (MP4, GIF) or as a picture (PNG, SVG); and printed metric by metric."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from cps_agents.arena.meeting import Meeting
from cps_agents.arena.table import RETURN
from cps_agents.console import err, note, out, print_json
from cps_agents.errors import CommandError, built_by_user
from cps_agents.files import replacing, write_text
from cps_agents.progress import Progress
from cps_agents.sheet import Sheet
from cps_envs.core.compute.generators import seeded
from cps_envs.core.errors import near, require
from cps_envs.core.game.game import Game
from cps_envs.core.game.match import Match
from cps_envs.core.game.play import finish
from cps_envs.core.game.problem import Problem
from cps_envs.core.game.recording import finish_recorded, kind_of
from cps_envs.core.picture.rendering import FRAMES_PER_SECOND, Renderer
from cps_envs.core.picture.svg import to_svg
from cps_envs.core.picture.viewer import recording_viewer
from cps_envs.core.policies.trace import report
from cps_envs.core.types import Array, FloatArray, Role
from cps_envs.registration import find_problem

if TYPE_CHECKING:
    from rich.console import Console


def show_meeting(
    meeting: Meeting, film: Film | None, record: Path | None, as_json: bool, explain: bool = False
) -> None:
    """Play a meeting, filming or recording its first episode, and print the metrics; `explain` says what they are.

    Raises:
        CommandError: both are asked for.
    """
    if film is not None and record is not None:
        raise CommandError("--render and --record each follow the episode in their own way: leave one of them out")
    if record is not None:
        kind_of(record)  # which refuses others before anything is played
    problem, config, seed = find_problem(meeting.problem), meeting.venue.config, meeting.first_seed
    players: dict[Role, str] = {"attacker": meeting.attacker, "defender": meeting.defender}
    outcome, game = _play(problem, config, players, range(seed, seed + meeting.episodes), film, record)
    heading = {"problem": problem.name, "preset": meeting.venue.preset, "config": config} | dict(players)
    if as_json:
        print_json(_document(heading, seed, outcome))
    else:
        units = {RETURN: problem.unit_of(config)}
        units |= {name: said.unit for name, said in game.measures.items()}
        _print(out(), heading, seed, outcome, units)
        if explain:
            meant = [(name, game.measures[name].says) for name in outcome if name in game.measures]
            out().print(Sheet("What the metrics say", ("Metric", "meaning"), meant, left=2))
        unit = f", in {units[RETURN]}" if units[RETURN] else ""
        paid = " + ".join(game.payoff_parts) if game.objective is None else game.objective.formula
        out().print(f"The return is the attacker's{unit}: {paid}.", markup=False)


def _play(
    problem: Problem, config: Any, players: Mapping[Role, str], seeds: range, film: Film | None, record: Path | None
) -> tuple[dict[str, Array], Game]:
    """Metrics by name, each (episodes,), and the game."""
    with built_by_user():
        match = problem.match(config, len(seeds), players)
        match.reset(np.ones(len(seeds), np.bool_), seeded(seeds))
        if record is not None:
            head: dict[str, Any] = {"seed": seeds[0], "config": asdict(config)}
            head |= {"attacker": players["attacker"], "defender": players["defender"]}
            with err().status("playing; the first time, the physics is compiled, too"):
                payoff, recording = finish_recorded(problem, match, head)
            with replacing(record) as draft:
                draft.write_bytes(recording.encoded(kind_of(record)))
            note(f"Recorded: seed {seeds[0]} ({record}).")
        elif film is None:
            with err().status("playing; the first time, the physics is compiled, too"):
                payoff = finish(match)
        else:
            total = len(film.stops(match.game))
            with Progress("frames", total) as progress:
                payoff = play_shown(match, film, problem, lambda done, _: progress.update(done))
            note(f"Shown: seed {seeds[0]} ({film.target}).")
    for said in filter(None, map(report, match.players.values())):
        note(f"Note: {said}.")
    metrics = {name: np.array(values) for name, values in match.game.metrics().items()}
    return {RETURN: payoff, **metrics}, match.game


def _document(heading: Mapping[str, Any], seed: int, outcome: Mapping[str, Array]) -> dict[str, Any]:
    count = len(outcome["return"])
    episodes = [
        {"seed": seed + b, **{name: values[b].item() for name, values in outcome.items()}} for b in range(count)
    ]
    mean = {name: float(values.mean()) for name, values in outcome.items()}
    return {**heading, "config": asdict(heading["config"]), "episodes": episodes, "mean": mean}


def _print(
    console: Console, heading: Mapping[str, Any], seed: int, outcome: Mapping[str, Array], units: Mapping[str, str]
) -> None:
    console.print(
        f"[bold]{heading['problem']}[/] (preset {heading['preset']}): "
        f"attacker [bold]{heading['attacker']}[/] against defender [bold]{heading['defender']}[/]"
    )
    count = len(outcome["return"])
    numbers = [(name, units.get(name, ""), *map(_number, values)) for name, values in outcome.items()]
    console.print(Sheet("", ("Metric", "unit", *(f"seed {seed + b}" for b in range(count))), numbers, left=2))
    if count > 1:
        rows = [
            (name, units.get(name, ""), *map(_number, (values.mean(), values.std(), values.min(), values.max())))
            for name, values in outcome.items()
        ]
        console.print(Sheet(f"{count} episodes", ("Metric", "unit", "mean", "deviation", "min", "max"), rows, left=2))


def _number(value: float) -> str:
    return f"{value:.0f}" if float(value).is_integer() else f"{value:.3f}"


SCREEN = "human"
PICTURES = (".png", ".svg")
SUFFIXES = (".mp4", ".gif", *PICTURES)
SPEED = 10.0  # game seconds per second of film
GIF_FRAMES, GIF_COLOURS = 100, 64  # at most, so that it fits into a page
Shoot = Callable[[Array], None]
Camera: TypeAlias = tuple[Renderer, Callable[[], None]]  # what draws, and what takes a frame


@dataclass(frozen=True)
class Film:
    """Where an episode is shown, and how fast.

    Raises:
        CommandError: the target is neither "human" nor a file of a known kind, or a number makes no sense.
    """

    target: str
    fps: float = FRAMES_PER_SECOND
    speed: float | None = None  # game seconds per second of film; None = 10, and faster where a GIF would get long
    at_s: float | None = None  # of a picture; None = the end of the episode

    def __post_init__(self) -> None:
        if self.target != SCREEN and self.suffix not in SUFFIXES:
            offered = ", ".join(f"FILE{suffix}" for suffix in SUFFIXES)
            hint = near(self.suffix, SUFFIXES) if self.suffix else ""
            raise CommandError(f"--render {self.target!r}: write {SCREEN}, or {offered}. {hint}".rstrip())
        for name, value in (("--fps", self.fps), ("--speed", self.speed)):
            if value is not None and not 0 < value < np.inf:
                raise CommandError(f"{name} {value:g} must be above 0")
        if self.at_s is not None and self.suffix not in PICTURES:
            raise CommandError("--at chooses the moment of a picture: use it with --render FILE.png or FILE.svg")

    @property
    def suffix(self) -> str:
        """The kind of file, lower case."""
        return Path(self.target).suffix.lower()

    def stops(self, game: Game) -> list[int]:
        """The game steps at which a frame is taken."""
        if self.suffix in PICTURES:
            wanted = game.horizon if self.at_s is None else round(self.at_s / game.step_s)
            if not 0 <= wanted <= game.horizon:
                raise CommandError(f"--at {self.at_s:g}: the episode lasts from 0 to {game.horizon * game.step_s:g} s")
            return [wanted]
        fps = FRAMES_PER_SECOND if self.target == SCREEN else self.fps
        stride = max((self.speed or SPEED) / fps / game.step_s, 1.0)
        if self.suffix == ".gif" and self.speed is None:
            stride = max(stride, game.horizon / (GIF_FRAMES - 1))
        return [*np.unique(np.arange(0, game.horizon, stride).round().astype(int)).tolist(), game.horizon]

    def shooting(self, problem: Problem, game: Game) -> AbstractContextManager[Camera]:
        """While the first environment of a game is drawn and frames of it are taken."""
        if self.suffix == ".svg":
            return nullcontext(_drawing(self, problem, game))
        renderer = Renderer(problem, game)
        return _screen(renderer) if self.target == SCREEN else _recorder(self, renderer)


def play_shown(match: Match, film: Film, problem: Problem, report: Callable[[int, int], None]) -> FloatArray:
    """Play a match that has been reset to its end, showing its first environment; returns the payoff (B,)."""
    game, stops = match.game, film.stops(match.game)
    payoff, now, running = np.zeros(game.num_envs), 0, True
    with film.shooting(problem, game) as (renderer, shoot):
        for place, stop in enumerate([*stops, game.horizon]):
            watched = place < len(stops) and renderer.remembers
            while stop > now and not game.terminated.all():
                if watched:
                    renderer.watch()
                stride = 1 if watched else stop - now
                payoff += match.step({}, ~game.terminated, stride)
                now += stride
            if running and place < len(stops):
                shoot()
                running = film.suffix in PICTURES or not game.terminated[0]
            report(min(place + 1, len(stops)), len(stops))
    return payoff


@contextmanager
def _screen(renderer: Renderer) -> Iterator[Camera]:
    def shoot() -> None:
        try:
            renderer.show()
        except RuntimeError as error:
            raise CommandError(f"no window can be opened ({error}): use --render FILE.mp4, .gif or .png") from error
        if renderer.hidden:
            raise CommandError("there is no display to open a window on: use --render FILE.mp4, .gif or .png")

    try:
        yield renderer, shoot
    finally:
        renderer.close()


def _drawing(film: Film, problem: Problem, game: Game) -> Camera:
    found = recording_viewer(problem, game.config)
    if found is None:
        problem.make_viewer(game.config)  # which says so where there is none
        raise CommandError(f"the viewer of {problem.name!r} draws pixels only: use --render FILE.png")
    viewer, recorder = found
    renderer = Renderer(problem, game, viewer)

    def shoot() -> None:
        renderer.draw()
        write_text(Path(film.target), to_svg(recorder, f"An episode of {problem.name}"))

    return renderer, shoot


@contextmanager
def _recorder(film: Film, renderer: Renderer) -> Iterator[Camera]:
    with replacing(Path(film.target)) as draft, _writer(draft, film) as write:
        yield renderer, lambda: write(renderer.frame())


def _writer(path: Path, film: Film) -> AbstractContextManager[Shoot]:
    imageio = require("imageio.v2", extra="render", purpose=f"writing {film.target}")
    if film.suffix == ".png":
        return nullcontext(lambda frame: imageio.imwrite(path, frame))
    if film.suffix == ".gif":
        return _animation(path, film.fps)
    require("imageio_ffmpeg", extra="render", purpose=f"writing {film.target}")
    return _movie(imageio.get_writer(path, fps=film.fps, codec="libx264", macro_block_size=2))


@contextmanager
def _movie(writer: Any) -> Iterator[Shoot]:
    with writer as opened:
        yield opened.append_data


@contextmanager
def _animation(path: Path, fps: float) -> Iterator[Shoot]:
    """A GIF by pillow, imageio's own engine for it; all frames share their colours, so that what stays is kept once.

    The colours of large areas are kept as they are drawn, the others of letters and edges are merged.
    """
    images = require("PIL.Image", extra="render", purpose="writing a GIF")
    frames: list[Array] = []
    yield lambda frame: frames.append(frame.copy())
    some = np.concatenate(frames[:: max(1, len(frames) // 8)]).reshape(-1, 3).astype(np.int32)
    numbers, area = np.unique((some[:, 0] << 16) | (some[:, 1] << 8) | some[:, 2], return_counts=True)
    colours = np.stack([numbers >> 16, numbers >> 8 & 255, numbers & 255], axis=1).astype(np.uint8)
    flat = colours[np.argsort(-area, kind="stable")[: GIF_COLOURS // 2]]
    others = images.fromarray(colours[None]).quantize(GIF_COLOURS - len(flat), method=images.Quantize.MAXCOVERAGE)
    palette = images.new("P", (1, 1))
    palette.putpalette(flat.tobytes() + bytes(others.getpalette()[: 3 * (GIF_COLOURS - len(flat))]))
    first, *others = [images.fromarray(frame).quantize(palette=palette, dither=images.Dither.NONE) for frame in frames]
    first.save(path, save_all=True, append_images=others, duration=1000.0 / fps, loop=0)
