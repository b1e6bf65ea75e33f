"""One episode of a meeting, played again and recorded: its pictures, and what both roles did, saw and believed.

That is rows of small whole numbers that a page can draw.
"""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding

from cps_agents.arena.meeting import Meeting
from cps_agents.report.reel import reel_of
from cps_envs.core.declare.fields import Fields
from cps_envs.core.game.match import Match
from cps_envs.core.picture.recording import Recorder, Shape
from cps_envs.core.picture.viewer import CanvasViewer, recording_viewer
from cps_envs.core.types import ROLES, Array, FloatArray, Role
from cps_envs.registration import find_problem

FINE, COARSE = 999, 99  # steps between the least and the greatest value: of few rows, and of many
FEW_ROWS, MOST_ROWS = 6, 48  # drawn as lines; drawn at all


@dataclass(frozen=True)
class Curve:
    """A time line of a replay: a quantity at k moments, in r rows."""

    name: str
    values: FloatArray  # (k, r)
    unit: str = ""
    about: str = ""
    whole: bool = False  # values are choices 0, 1, ...
    labels: Sequence[str] = ()  # of the rows

    def document(self) -> dict[str, Any]:
        """Plain data; `rows` are whole numbers from 0 to `steps`, which stand for `low` to `high`."""
        every = np.nan_to_num(self.values, posinf=0.0, neginf=0.0)
        rows = every.T[:: -(-every.shape[1] // MOST_ROWS)]
        low, high = float(rows.min()), float(rows.max())
        steps = (round(high - low) or 1) if self.whole else FINE if len(rows) <= FEW_ROWS else COARSE
        scaled = np.zeros(rows.shape) if high == low else (rows - low) / (high - low) * steps
        return {
            "name": self.name,
            "unit": self.unit,
            "about": self.about,
            "whole": self.whole,
            "labels": list(self.labels) if len(self.labels) == len(rows) else [],
            "count": every.shape[1],  # of rows, before some are left out
            "low": float(f"{low:.5g}"),
            "high": float(f"{high:.5g}"),
            "steps": steps,
            "rows": np.rint(scaled).astype(int).tolist(),
        }


@dataclass
class Diary:
    """What a role observed, did and believed at each moment of a recorded episode."""

    observations: list[Array] = field(default_factory=list)  # (size,) each
    actions: list[Array] = field(default_factory=list)
    beliefs: list[Mapping[str, Array]] = field(default_factory=list)  # (r,) each

    def document(self, fields: Fields, space: spaces.Space[Any], moments: Sequence[int]) -> dict[str, Any]:
        """The tracks of what was done, seen and believed at some moments."""
        parts = {
            "actions": [action_track(np.array(self.actions)[moments], space)],
            "observations": observation_tracks(np.array(self.observations)[moments], fields),
            "beliefs": belief_tracks([self.beliefs[place] for place in moments]),
        }
        return {name: [track.document() for track in tracks] for name, tracks in parts.items()}


def action_track(actions: Array, space: spaces.Space[Any]) -> Curve:
    """The actions (k, ...) in force at each moment."""
    rows = actions.reshape(len(actions), -1).astype(np.float64)
    discrete = isinstance(space, (spaces.Discrete, spaces.MultiDiscrete))
    about = "number of the choice" if discrete else "share of the largest possible"
    return Curve("Action", rows, about=about, whole=discrete)


def observation_tracks(observations: Array, fields: Fields) -> list[Curve]:
    """What was observed, field by field in physical units; `observations` (k, size) are encoded."""
    decoded = fields.decode(observations)
    return [
        Curve(each.name, decoded[each.name].reshape(len(observations), -1), each.unit, each.description)
        for each in fields
        if each.size
    ]


def belief_tracks(beliefs: Sequence[Mapping[str, Array]]) -> list[Curve]:
    """What a policy told of its beliefs at each moment; nothing where it told none."""
    if not beliefs:
        return []
    return [
        Curve(name, np.array([np.ravel(each[name]) for each in beliefs], np.float64))
        for name in beliefs[-1]
        if all(name in each for each in beliefs)
    ]


MOST_FRAMES = 121
STRIDES = (1, 2, 3, 4, 6, 8)


@dataclass(frozen=True)
class Take:
    """An episode that is to be recorded."""

    meeting: Meeting
    seed: int
    key: str  # of its file
    most_bytes: int = 1_000_000  # packed; moments are left out until it fits

    @property
    def label(self) -> str:
        """Its name in progress bars."""
        return f"{self.meeting.label}, seed {self.seed}"


def record(take: Take) -> str:
    """Play an episode as its meeting played it, and pack at most MOST_FRAMES moments of it."""
    meeting = take.meeting
    problem, config = find_problem(meeting.problem), meeting.venue.config
    players: dict[Role, Any] = {"attacker": meeting.attacker, "defender": meeting.defender}
    match = problem.match(config, 1, players)
    match.reset(np.ones(1, np.bool_), [seeding.np_random(take.seed)[0]])
    camera = ReplayCamera(match, recording_viewer(problem, config))
    camera.paid = camera.run()
    return _fitting(camera, take)


def _fitting(camera: ReplayCamera, take: Take) -> str:
    """The packed episode with as many moments as fit."""
    packed = ""
    for stride in STRIDES:
        packed = pack({"seed": take.seed, **camera.document(stride)})
        if len(packed) <= take.most_bytes:
            break
    return packed


def pack(episode: Mapping[str, Any]) -> str:
    """An episode as base64 text of compressed JSON."""
    plain = json.dumps(episode, separators=(",", ":"), allow_nan=False)
    return base64.b64encode(gzip.compress(plain.encode(), 9, mtime=0)).decode()


class ReplayCamera:
    """Plays a match of one environment to its end and keeps some of its moments."""

    def __init__(self, match: Match, drawing: tuple[CanvasViewer, Recorder] | None) -> None:
        self._match, self.paid = match, 0.0
        self._viewer: CanvasViewer | None = drawing[0] if drawing else None
        self._recorder: Recorder | None = drawing[1] if drawing else None
        self._times: list[float] = []
        self._pictures: list[list[Shape]] = []
        self._diaries: dict[Role, Diary] = {role: Diary() for role in ROLES}
        self._intervals = [match.game.decision_interval[role] for role in ROLES]
        self._noted: dict[Role, Any] = {}  # choices since the last moment

    def run(self) -> float:
        """Play; returns what the attacker is paid."""
        game, now, paid = self._match.game, 0, 0.0
        stops = np.unique(np.linspace(0, game.horizon, MOST_FRAMES).round().astype(int)).tolist()
        watch = getattr(self._viewer, "watch", None)
        for stop in stops:
            while now < stop and not game.terminated[0]:
                stride = 1 if watch else min(stop - now, *(every - now % every for every in self._intervals))
                paid += float(self._match.step({}, ~game.terminated, stride)[0])
                now += stride
                self._note()
                if watch is not None and now < stop:
                    watch(game.scene(0))
            self._shoot(now)
            if game.terminated[0]:
                break
        return paid

    def document(self, stride: int) -> dict[str, Any]:
        """Pictures, times and tracks as plain data; every so many moments, and the last."""
        game, last = self._match.game, len(self._times) - 1
        moments = sorted({*range(0, last + 1, stride), last})
        tracks = {
            role: diary.document(game.fields[role], game.action_space[role], moments)
            for role, diary in self._diaries.items()
        }
        pictures = (self._pictures[place] for place in moments)
        return {
            "return": self.paid,
            "metrics": {name: values.item(0) for name, values in game.metrics().items()},
            "times": [self._times[place] for place in moments],
            "tracks": tracks,
            "reel": None if self._recorder is None else reel_of(self._recorder, pictures),
        }

    def _note(self) -> None:
        """Keep a choice that differs from the last moment's, so that one that lasts shorter than a moment is seen."""
        for role, diary in self._diaries.items():
            chosen = self._match.action(role)[0]
            whole = np.issubdtype(np.asarray(chosen).dtype, np.integer)
            if whole and diary.actions and role not in self._noted and not np.array_equal(chosen, diary.actions[-1]):
                self._noted[role] = np.copy(chosen)

    def _shoot(self, step: int) -> None:
        game = self._match.game
        if self._viewer is not None and self._recorder is not None:
            self._viewer.draw(game.scene(0))
            self._pictures.append(self._recorder.shapes)
        self._times.append(round(step * game.step_s, 6))
        for role, diary in self._diaries.items():
            diary.observations.append(game.observe(role)[0])
            diary.actions.append(self._noted.pop(role, self._match.action(role)[0]))
            diary.beliefs.append({name: values[0] for name, values in self._match.beliefs(role).items()})
