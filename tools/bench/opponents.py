"""What each opponent costs the environment that asks it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

from cps_agents.warm import Overrides
from cps_agents.zoo.card import SHIPPED, read_card
from cps_agents.zoo.files import shipped_names
from cps_envs.core.errors import ConfigurationError, MissingExtraError
from cps_envs.core.game.problem import Problem
from cps_envs.core.policies.lookup import NEED_OPTIONS, policy_names
from cps_envs.core.types import ROLES, Role, other
from tools.bench.row import Call, Measurement, Values, Yardsticks, calls_per_s

PART = "opponents"
NUM_ENVS = (1, 64)
SOLVER = "solver"
USUAL = "usual in"
LEFT_OUT = ("none", *NEED_OPTIONS)  # what others are compared with; and a mixture costs what its policies cost
SOLVERS: Mapping[str, str] = {  # policies that solve a program at each decision, or one at the start of an episode
    "disbanding.attacker.ga": "ga?generations=1&population=4",  # its search is not counted: keep it short
    "disbanding.defender.mpc": "mpc",
    "disbanding.defender.mpc_tuned": "mpc_tuned",
    "disbanding.defender.joint": "joint",
    "fdi.attacker.bnb": "bnb",
    "fdi.attacker.lp_greedy": "lp_greedy",
}
OPTIONS: Mapping[str, tuple[str, Mapping[str, Any]]] = {  # policies that want more than a preset
    "disbanding.attacker.plan": ("plan?events=[[10,1],[9,2]]", {}),
    "disbanding.attacker.every_other": ("every_other", {"attack_budget": 5}),
    "hvac.defender.mtd1": ("mtd1", {"window_steps": 100}),  # a full window decides, which comes early so
    "hvac.defender.mtd2": ("mtd2", {"window_steps": 100}),
}


@dataclass(frozen=True)
class Opponent:
    """A policy with the configurations that it may fit; the first one that it does is taken."""

    problem: Problem
    role: Role
    reference: str
    configurations: Sequence[tuple[str, Overrides]]  # presets, and what is changed in them
    solver: bool = False

    def measure(self, seconds: float, yardsticks: Yardsticks) -> Values:
        """Microseconds of a neutral decision of the other role, and how often those with `none` go into them.

        Solvers are measured with one environment only.
        """
        values: dict[str, float] = {}
        for envs in NUM_ENVS[:1] if self.solver else NUM_ENVS:
            found = self._fitting(envs)
            asked, idle = (
                1e6 / envs / calls_per_s(self._decision(*found, envs, reference), seconds / 2)
                for reference in (self.reference, "none")
            )
            values |= {f"us_{envs}": asked, f"times_none_{envs}": asked / idle}
        return values

    def _fitting(self, envs: int) -> tuple[str, Overrides]:
        """The first configuration that the policy fits.

        Raises:
            ConfigurationError: there is none; the message is the last one's.
        """
        why: Exception = ConfigurationError("no presets")
        for preset, overrides in self.configurations:
            try:
                self._decision(preset, overrides, envs, self.reference)()
            except (ConfigurationError, MissingExtraError, TypeError) as error:
                why = error
            else:
                return preset, overrides
        raise ConfigurationError(str(why)) from why

    def _decision(self, preset: str, overrides: Overrides, envs: int, reference: str) -> Call:
        options = {"preset": preset, "opponent": reference, "interface": "native", **overrides}
        made: Any = gymnasium.make_vec(self.problem.env_id(other(self.role)), envs, "vector_entry_point", **options)
        made.reset(seed=0)
        neutral = np.stack([made.game.neutral_action[made.role]] * envs)
        return lambda: made.step(neutral)


def _usual(problem: Problem) -> Iterator[Measurement]:
    """Whom each preset plays against unless somebody is named."""
    for preset, usual in problem.opponents.items():
        for role, reference in usual.items():
            solver = f"{problem.name}.{role}.{reference}" in SOLVERS
            if reference != "none":
                found = Opponent(problem, role, reference, [(preset, {})], solver)
                name = f"{problem.name}.{role}.{USUAL} {preset}"
                yield Measurement(PART, name, found.measure, SOLVER if solver else "")


def items(problems: list[Problem]) -> Iterator[Measurement]:
    """The policies of both roles that have names, and the trained ones."""
    cards = [read_card(SHIPPED / f"{name}.json") for name in shipped_names()]
    for problem in problems:
        yield from _usual(problem)
        for role in ROLES:
            for name in policy_names(problem.name, role):
                if name in LEFT_OUT:
                    continue
                full = f"{problem.name}.{role}.{name}"
                reference, wanted = OPTIONS.get(full, (SOLVERS.get(full, name), {}))
                presets = [(preset, wanted) for preset in problem.presets]
                found = Opponent(problem, role, reference, presets, full in SOLVERS)
                yield Measurement(PART, full, found.measure, SOLVER if found.solver else "")
            for card in cards:
                if (card.problem, card.role) == (problem.name, role):
                    own = Opponent(problem, role, f"zoo:{card.name}", [(card.preset, card.overrides)])
                    yield Measurement(PART, f"{problem.name}.{role}.zoo:{card.name}", own.measure)
