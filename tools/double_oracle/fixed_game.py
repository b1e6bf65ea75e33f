"""The game between fixed defenders and switching attackers, which a double oracle solves: matrix rows and responses.

The defenders are all assignments of one law to each intact vehicle, and the paper's that detect. There are so few that
an attack is played against every one of them: the defender's best response is exact. The attacker's is searched, so
the value is a lower bound of that against all switching laws.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from cps_baselines.rogue.assignment import laws_of
from cps_baselines.rogue.switching import SIZE, Switching, shipped_weights
from cps_envs.core.declare.config import configure
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, IntArray, Role, State
from cps_envs.rogue.config import PAPER, RogueConfig
from cps_envs.rogue.problem import ROGUE
from cps_paper.rogue.worlds import REPORTED, world_config
from tools.evolving import evolve
from tools.rogue.switching import SEARCHED

REAR_LAWS, LAWS = "lsfh", "lsfrh"  # the rear vehicle has nobody behind it to follow
ASSIGNED = tuple("".join(laws) for laws in product(REAR_LAWS, *[LAWS] * (PAPER.num_intact - 1)))
DETECTING = ("sliding_detection", "disband_2", "disband_4", "disband_7")
DEFENDERS = (*ASSIGNED, *DETECTING)
FIRST_LAWS = ("all", "sliding_detection")  # of those that came with the package: the first rows
LEAST_SHARE = 0.02  # of a defender that a search looks at
ORIGIN_SPREAD, KNOWN_SPREAD = 1.0, 0.5  # of a search from zero, and of one from the best attack so far


@dataclass(frozen=True)
class FixedGame:
    """The attacker is paid the damage and `weight_mps2` times the formation cost, in the worlds of `tools.rogue`."""

    power_ratio: float
    weight_mps2: float = 0.5  # that of preset `easy`
    worlds: int = 2
    population: int = 12
    generations: int = 10
    seed: int = 0
    fresh_worlds: int = 8  # in which the strategies are valued

    def first(self) -> list[FloatArray]:
        """Weights (7,) to begin with."""
        known = shipped_weights()
        ratio = min((each for _, each in known), key=lambda each: abs(each - self.power_ratio))
        return [known[name, ratio] for name in FIRST_LAWS]

    def row(self, weights: FloatArray) -> FloatArray:
        """What a switching law (7,) is paid by each of `DEFENDERS`, the mean over the worlds."""
        paid: FloatArray = self._rows(weights, DEFENDERS, range(REPORTED, REPORTED + self.worlds)).mean(axis=1)
        return paid

    def fresh(self, weights: FloatArray, defenders: IntArray) -> FloatArray:
        """What a switching law (7,) is paid by some of `DEFENDERS` in each of the fresh worlds, (k, worlds)."""
        first = REPORTED + self.worlds
        return self._rows(weights, [DEFENDERS[k] for k in defenders], range(first, first + self.fresh_worlds))

    def respond(self, defender: FloatArray, known: FloatArray, number: int) -> FloatArray:
        """The switching law (7,) that a search finds against a mixture of `DEFENDERS`, from zero and a known law."""
        shares = np.where(defender >= LEAST_SHARE, defender, 0.0)
        champions: list[tuple[float, FloatArray]] = []
        starts = ((known * np.sqrt(SIZE) / np.linalg.norm(known), KNOWN_SPREAD), (np.zeros(SIZE), ORIGIN_SPREAD))
        for run, (origin, spread) in enumerate(starts):

            def judge(candidates: FloatArray, generation: int, run: int = run) -> FloatArray:
                place = (2 * number + run) * self.generations + generation
                return self._judge(candidates, shares, SEARCHED + place * self.worlds)

            sizes = {"population": self.population, "generations": self.generations}
            champions += evolve(judge, origin, spread, **sizes, seed=[self.seed, number, run])
        best = np.array([weights for _, weights in sorted(champions, key=lambda pair: -pair[0])[:4]])
        last = 2 * (number + 1) * self.generations
        judged = self._judge(best, shares, SEARCHED + last * self.worlds)
        weights: FloatArray = np.round(best[int(judged.argmax())], 4)
        return weights

    def _rows(self, weights: FloatArray, names: Sequence[str], seeds: range) -> FloatArray:
        """What a switching law (7,) is paid by each defender (k,) in each world, (k, worlds)."""
        assigned = [name for name in names if name not in DETECTING]
        found: dict[str, FloatArray] = {}
        if assigned:
            orders = np.repeat(np.stack([laws_of(laws, "laws").ravel() for laws in assigned]), len(seeds), axis=0)
            paid = self._paid(weights, Orders(self._spec("defender"), orders), list(seeds) * len(assigned))
            found |= dict(zip(assigned, paid.reshape(len(assigned), -1), strict=True))
        found |= {name: self._paid(weights, name, seeds) for name in names if name in DETECTING}
        return np.stack([found[name] for name in names])

    def _judge(self, candidates: FloatArray, shares: FloatArray, first: int) -> FloatArray:
        """What candidates (P, 7) are paid by the mixture, the mean over worlds from `first` on (P,)."""
        count, seeds = len(candidates), range(first, first + self.worlds)
        weights, paid = np.repeat(candidates, self.worlds, axis=0), np.zeros(count)
        for k in np.flatnonzero(shares):
            found = self._paid(weights, _reference(DEFENDERS[k]), list(seeds) * count)
            paid += shares[k] * found.reshape(count, -1).mean(axis=1)
        return paid

    def _paid(self, weights: FloatArray, defender: PolicyReference, seeds: Sequence[int]) -> FloatArray:
        players: dict[Role, PolicyReference] = {
            "attacker": Switching(self._spec("attacker"), weights),
            "defender": defender,
        }
        return np.asarray(play_episodes(ROGUE, self._config(), players, list(seeds))["return"])

    def _spec(self, role: Role) -> RoleSpec:
        return ROGUE.game(self._config(), 1).spec(role)

    def _config(self) -> RogueConfig:
        found: RogueConfig = configure(world_config(self.power_ratio), {"formation_weight_mps2": self.weight_mps2})
        return found


class Orders(AnalyticPolicy):
    """Other orders (B, 2 k) for each episode, kept all the time."""

    def __init__(self, spec: RoleSpec, orders: IntArray) -> None:
        super().__init__(spec)
        self.orders = orders

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The orders as they are."""
        return self.orders, state


def _reference(name: str) -> str:
    return name if name in DETECTING else f"assigned?laws={name}"
