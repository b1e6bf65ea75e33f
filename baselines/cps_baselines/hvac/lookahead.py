"""A defender that is told the present state of the episode, and tries every choice on copies of it."""

from __future__ import annotations

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, told_of
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Generators, Knowledge, State
from cps_envs.hvac.attack import bias_action
from cps_envs.hvac.game import HvacGame


class Lookahead(AnalyticPolicy):
    """Plays every legal choice for `horizon_steps` on copies of the episode, and holds the one that costs least.

    It knows the present and not the future: the copies have no noise to come, unknown heat and the forecast's error
    stay what they are now, and liars go on with the bias that they show. No attack begins in them, and all costs count
    from now on. It chooses anew every `hold_steps`. Choices steer the heating, so this pays less than any estimate can
    that is only close to the truth. It is no bound: longer plans, or the future itself, may pay less.

    Raises:
        ConfigurationError: numbers of steps that are not positive.
    """

    privileged = frozenset({"model"})

    def __init__(self, spec: RoleSpec, *, horizon_steps: int = 20, hold_steps: int = 5) -> None:
        super().__init__(spec)
        if min(horizon_steps, hold_steps) < 1:
            raise ConfigurationError(f"horizon_steps = {horizon_steps}, hold_steps = {hold_steps}: choose at least 1")
        self._horizon_steps, self._hold_steps = horizon_steps, hold_steps
        self._count = int(spec.action_space.n)  # type: ignore[attr-defined]

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """What hands out copies of each episode (B,), its choice (B,), and for how many steps that holds (B,)."""
        count = len(knowledge)
        return told_of(knowledge), np.zeros(count, np.int64), np.zeros(count, np.int64)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Choices (B,)."""
        told, choice, left = state[0], state[1].copy(), state[2] - 1
        for b in np.flatnonzero(left < 0):
            choice[b] = self._best(told[b]["model"](self._count))
            left[b] = self._hold_steps - 1
        return choice, (told, choice, left)

    def _best(self, copies: HvacGame) -> int:
        """The legal choice that pays least on copies of an episode, one for each choice."""
        lies = go_on(copies)
        legal = copies.action_mask("defender")
        assert legal is not None
        steps = min(self._horizon_steps, copies.horizon - int(copies.elapsed[0]))
        payoff = copies.advance({"attacker": lies, "defender": np.arange(self._count)}, legal[0], steps)
        return int(np.where(legal[0], payoff, np.inf).argmin())


def go_on(copies: HvacGame) -> Array:
    """Take what is to come out of copies of one episode, and return the actions (C, S + 1) of an attack that stays."""
    state, k = copies.state, int(copies.state.step[0])
    state.series[:, k + 1 :] = 0.0
    for course in (state.heat_drift, state.outdoor_error):
        course[:, k + 1 :] = course[:, k : k + 1]
    state.compromised[:] &= k >= state.onset[:, np.newaxis]
    state.onset[:] = 0
    bias_c = state.temperature[:, copies.constants.zone] - state.reading
    return bias_action(copies.config, bias_c, keep_noise=copies.config.attack_action == "bias")
