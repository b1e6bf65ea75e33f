"""Episodes of any problem for the tests; tests of one problem take them as `partial(play, PROBLEM)`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from cps_envs.core.conformance.actors import Actor
from cps_envs.core.game.play import play_episodes
from cps_envs.core.game.problem import Problem
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Role, State

OnAct = Callable[[Seen, State, Array, Array, State], None]  # seen, state, the agents' actions, the role's, next state


def started(problem: Problem, seeds: Sequence[int] = (0,), preset: str = "paper", **overrides: Any) -> Any:
    """A game with an environment for each seed, reset."""
    game = problem.game(problem.config(preset, overrides), len(seeds))
    game.reset(np.ones(len(seeds), bool), [np.random.default_rng(seed) for seed in seeds])
    return game


def spec_of(problem: Problem, role: Role, preset: str = "paper", **overrides: Any) -> RoleSpec:
    """The interface of a role."""
    return problem.game(problem.config(preset, overrides), 1).spec(role)


def play(
    problem: Problem,
    attacker: Any,
    defender: Any = "none",
    seeds: Sequence[int] = (0,),
    preset: str = "paper",
    on_step: Callable[..., Any] | None = None,
    **overrides: Any,
) -> dict[str, Array]:
    """The outcome of an episode per seed."""
    players = {"attacker": attacker, "defender": defender}
    return play_episodes(problem, problem.config(preset, overrides), players, seeds, on_step=on_step)


def watched(
    problem: Problem,
    see: Callable[[Any], Any],
    attacker: Any = "none",
    defender: Any = "none",
    seeds: Sequence[int] = (0,),
    preset: str = "paper",
    **overrides: Any,
) -> list[Any]:
    """What `see` finds in the game at the start of the episodes and after each decision."""
    found: list[Any] = []
    play(problem, attacker, defender, seeds, preset, lambda game: found.append(see(game)), **overrides)
    return found


def noted(policy: AnalyticPolicy, note: Callable[[Seen, Array, Any], Any]) -> list[Any]:
    """What `note` says of each decision of a policy from now on: of what it saw, did and will remember."""
    found: list[Any] = []
    act = policy.act

    def noting(seen: Seen, state: State) -> tuple[Array, State]:
        actions, after = act(seen, state)
        found.append(note(seen, actions, after))
        return actions, after

    policy.act = noting  # type: ignore[method-assign]
    return found


def observed(spec: RoleSpec, **values: Any) -> Array:
    """An observation (1, size) with these values at the beginning of their fields, in units; zeros elsewhere."""
    row = np.zeros((1, spec.fields.size))
    for name, value in values.items():
        start = spec.fields.slices[name].start
        row[0, start : start + np.size(value)] = np.ravel(value)
    return spec.fields.encode(row)


def seen_by(game: Any, adapter: Adapter) -> Seen:
    """What an adapter of a game's role is shown of all environments."""
    role = adapter.spec.role
    team = game.team(role).observe() if adapter.local else None
    return Seen(game.fields[role], game.observe(role), masks=game.action_mask(role), team=team)


class Through(AnalyticPolicy):
    """Plays through an adapter: one action of all its agents, or drawn legal ones without one."""

    masked = True

    def __init__(self, adapter: Adapter, action: Any = None, on_act: OnAct | None = None) -> None:
        super().__init__(adapter.spec)
        self.adapter, self.action, self.on_act = adapter, action, on_act
        self.decentralised = adapter.local
        self._actor = Actor(adapter.action_space, adapter.neutral_action, 0, boldness=1.0)

    def begin(self, generators: Any, knowledge: Any) -> State:
        """The adapter's."""
        return self.adapter.begin(len(generators))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Each agent's choice, joined; nothing can write to the state that it came from."""
        for array in state or ():
            array.setflags(write=False)
        chosen = self._chosen(seen, state)
        action, after = self.adapter.act(seen, state, chosen)
        if self.on_act is not None:
            self.on_act(seen, state, chosen, action, after)
        return action, after

    def _chosen(self, seen: Seen, state: State) -> Array:
        shape = (len(seen), len(self.adapter.agents))
        if self.action is not None:
            return np.full((*shape, *np.shape(self.adapter.neutral_action)), self.action)
        masks = self.adapter.masks(seen, state)
        drawn = [self._actor.act(None if masks is None else masks[place]) for place in np.ndindex(shape)]
        return np.reshape(drawn, (*shape, *np.shape(self.adapter.neutral_action)))
