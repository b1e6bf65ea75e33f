"""One episode of a meeting, played again and recorded: its pictures, and what both roles did, saw and believed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from cps_agents.arena.meeting import Meeting
from cps_agents.report.reel import Reel
from cps_agents.report.tracks import Diary
from cps_envs.core.match import Match
from cps_envs.core.picture.viewer import recording_viewer
from cps_envs.core.types import ROLES, Role
from cps_envs.registration import find_problem

MOST_FRAMES = 150


@dataclass(frozen=True)
class Take:
    """An episode that is to be recorded."""

    meeting: Meeting
    seed: int
    key: str  # of its file

    @property
    def label(self) -> str:
        """For progress."""
        return f"{self.meeting.label}, seed {self.seed}"


def record(take: Take) -> dict[str, Any]:
    """Play an episode as its meeting played it, and record at most MOST_FRAMES moments of it."""
    meeting = take.meeting
    problem, config = find_problem(meeting.problem), meeting.venue.config
    players: dict[Role, Any] = {"attacker": meeting.attacker, "defender": meeting.defender}
    match = problem.match(config, 1, players)
    match.reset(np.ones(1, np.bool_), [seeding.np_random(take.seed)[0]])
    camera = Camera(match, recording_viewer(problem, config))
    paid = camera.run()
    return {
        "seed": take.seed,
        "return": paid,
        "metrics": {name: values.item(0) for name, values in match.game.metrics().items()},
        **camera.document(),
    }


class Camera:
    """Plays a match of one environment to its end and keeps some of its moments."""

    def __init__(self, match: Match, drawing: tuple[Any, Any] | None) -> None:
        self._match = match
        self._viewer = None if drawing is None else drawing[0]
        self._reel = None if drawing is None else Reel(drawing[1])
        self._times: list[float] = []
        self._diaries: dict[Role, Diary] = {role: Diary() for role in ROLES}

    def run(self) -> float:
        """Play; returns what the attacker is paid."""
        game, now, paid = self._match.game, 0, 0.0
        stops = np.unique(np.linspace(0, game.horizon, MOST_FRAMES).round().astype(int)).tolist()
        remembers = hasattr(self._viewer, "watch")
        for stop in stops:
            while now < stop and not game.terminated[0]:
                stride = 1 if remembers else stop - now
                paid += float(self._match.step({}, ~game.terminated, stride)[0])
                now += stride
                if remembers and now < stop and self._viewer is not None:
                    self._viewer.watch(game.scene(0))
            self._shoot(now)
            if game.terminated[0]:
                break
        return paid

    def document(self) -> dict[str, Any]:
        """Pictures, times and tracks as plain data."""
        game = self._match.game
        tracks = {
            role: diary.document(game.fields[role], game.action_space[role]) for role, diary in self._diaries.items()
        }
        return {"times": self._times, "tracks": tracks, "reel": None if self._reel is None else self._reel.document()}

    def _shoot(self, step: int) -> None:
        game = self._match.game
        if self._viewer is not None and self._reel is not None:
            self._viewer.draw(game.scene(0))
            self._reel.take()
        self._times.append(round(step * game.step_s, 6))
        for role, diary in self._diaries.items():
            diary.observations.append(game.observe(role)[0])
            diary.actions.append(self._match.action(role)[0])
            diary.beliefs.append({name: values[0] for name, values in self._match.beliefs(role).items()})
