"""Extension beyond the paper: an attacker that plans each episode by beam search on copies of the world."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import unpack
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.match import Match
from cps_envs.core.policies.policy import AnalyticPolicy, Policy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, IntArray, Knowledge, State
from cps_envs.rogue.game import RogueGame
from cps_envs.rogue.state import Drawn

EFFORTS = (-1.0, 1.0)  # full braking and full driving, what every searched attacker uses
Model = Callable[[int], RogueGame]


class Beam(NamedTuple):
    """How a beam search ranks and keeps what it has reached."""

    hold: int  # decisions of the attacker for which an effort lasts
    foresight: float  # what 1 m/s of closing speed counts beside 1 of the payoff so far
    width: int = 320  # action sequences that are kept
    cell_m: float = 2.0  # two sequences that lead to the same cell of gaps, speeds and alarms count as one
    cell_mps: float = 2.0


BEAMS = (  # chosen: none of them is best against all
    Beam(hold=2, foresight=1.0),
    Beam(hold=5, foresight=0.3),
    Beam(hold=3, foresight=0.1),
    Beam(hold=2, foresight=0.1),
)


class BeamPlan(NamedTuple):
    """A sequence of the attacker's actions from now to the end, one for each game step."""

    actions: FloatArray  # (T,)
    payoff: float  # of the attacker, from now on


def plan_by_beam(model: Model, defender: Policy | None, beam: Beam) -> BeamPlan:
    """The best action sequence that a beam search finds on copies of an episode, against the defender in it.

    Every kept sequence is continued by each of `EFFORTS`. Of those that lead to the same cell the best one stays, and
    of these the `width` best. A sequence is as good as what it has earned, and `foresight` times the closing speeds of
    all pairs. An open-loop plan: it knows the noise and the draws of the episode.
    """
    game = model(beam.width * len(EFFORTS))
    match = Match(game, {} if defender is None else {"defender": defender})
    everywhere = np.ones(game.num_envs, np.bool_)
    match.begin(everywhere, [np.random.default_rng(0) for _ in range(game.num_envs)])
    actions = np.tile(EFFORTS, beam.width)[:, np.newaxis]
    earned, history = np.zeros(game.num_envs), list[IntArray]()
    left, hold = game.horizon - int(game.elapsed[0]), beam.hold * game.decision_interval["attacker"]
    for done in range(0, left, hold):
        earned += match.step({"attacker": actions}, everywhere, min(hold, left - done))
        kept = _keep(game, earned, beam)
        history.append(kept)
        parents = np.repeat(kept, len(EFFORTS))
        match.branch(parents)
        earned = earned[parents]
    return BeamPlan(np.repeat(_trace(history), hold)[:left], float(earned[0]))


def _keep(game: RogueGame, earned: FloatArray, beam: Beam) -> IntArray:
    """The environments (width,) that are continued, the best in what they have earned first."""
    state, drawn = game.state, unpack(Drawn, game.drawn, 0)
    seat, closing = drawn.attacker, np.maximum(-np.diff(state.speed[:, : drawn.num_vehicles], axis=1), 0.0).sum(axis=1)
    order = np.argsort(-(earned + beam.foresight * closing), kind="stable")
    around = slice(max(seat - 1, 0), seat + 2)  # the seized vehicle and its neighbours
    places, speeds = state.position[:, around] - state.position[:, [seat]], state.speed[:, around]
    cells = np.concatenate([places / beam.cell_m, speeds / beam.cell_mps, state.alarm], axis=1)
    _, first = np.unique(np.floor(cells[order]).astype(np.int64), axis=0, return_index=True)
    chosen = order[np.sort(first)[: beam.width]]
    kept: IntArray = np.resize(chosen[np.argsort(-earned[chosen], kind="stable")], beam.width)
    return kept


def _trace(history: Sequence[IntArray]) -> FloatArray:
    """The efforts of the sequence that comes first at the end, from its beginning."""
    row, efforts = 0, list[float]()
    for kept in reversed(history):
        row, effort = divmod(int(kept[row]), len(EFFORTS))
        efforts.append(EFFORTS[effort])
    return np.array(efforts[::-1])


class BeamPlanner(AnalyticPolicy):
    """Plans the whole episode at its start, by beam search, and plays the best plan.

    An oracle: it knows what the episode draws, the noise and the defender it will meet; a defender that draws is
    planned against with other draws. It takes some seconds for an episode. `width` is that of the beams; without,
    their own.

    Raises:
        ConfigurationError: a width below 1.
    """

    privileged = frozenset({"model", "opponent"})

    def __init__(self, spec: RoleSpec, width: int = BEAMS[0].width) -> None:
        super().__init__(spec)
        if width < 1:
            raise ConfigurationError(f"width = {width} has to be at least 1")
        self.beams = tuple(beam._replace(width=int(width)) for beam in BEAMS)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The plans (B, T)."""
        return (np.stack([self._plan(known["model"], known["opponent"]).actions for known in knowledge]),)

    def _plan(self, model: Model, defender: Policy | None) -> BeamPlan:
        return max((plan_by_beam(model, defender, beam) for beam in self.beams), key=lambda plan: plan.payoff)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The actions (B, 1) of the plans."""
        done = (self.spec.config.duration_s - seen["time_left_s"]) / self.spec.config.control_period_s
        step = np.minimum(np.rint(done).astype(np.int64), state[0].shape[1] - 1)
        return np.take_along_axis(state[0], step[:, np.newaxis], axis=1), state
