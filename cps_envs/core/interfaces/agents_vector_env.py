"""Several agents in B episodes at once: the batched form of the PettingZoo interface."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

from cps_envs.core.declare.config import check_count
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.agents_batch import AgentsForm
from cps_envs.core.interfaces.agents_env import check_agents
from cps_envs.core.interfaces.options import Seeds, check_autoreset, check_mask, reseeded
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, Observation, Role

Results = tuple[
    dict[str, Observation], dict[str, FloatArray], dict[str, BoolArray], dict[str, BoolArray], dict[str, Any]
]


class AgentsVectorEnv(AgentsForm):
    """`AgentsEnv` for B episodes: what is a number there is an array (B,) here, and an array (n,) is one (B, n).

    Environment i of a batch seeded s equals the single environment seeded s + i. `infos` has an array (B,) for each
    metric, `cost`, and for each agent `due` and, where not all actions are legal, `action_mask` (B, k) by its name.
    With `autoreset="same_step"` ended episodes restart at once, and `infos["final_obs"]` has their last observations
    by agent, `infos["final_info"]` their last metrics; with `"next_step"` the next step starts them and plays nothing
    there; with `"disabled"` you call `reset(options={"reset_mask": ended})`.
    """

    def __init__(
        self,
        problem: Problem,
        name: str,
        adapters: Mapping[Role, str | None],
        num_envs: int,
        *,
        max_cycles: int | None = None,
        autoreset: str | AutoresetMode = AutoresetMode.SAME_STEP,
        **options: Any,
    ) -> None:
        """`adapters` names those of the roles that are played from outside; `options` are those of `AgentsBatch`."""
        self.num_envs = check_count("num_envs", num_envs)
        super().__init__(problem, name, adapters, self.num_envs, max_cycles, options)
        self.autoreset_mode = check_autoreset(autoreset)
        self.metadata = {"name": self._name, "autoreset_mode": self.autoreset_mode}
        self.agents = self.possible_agents[:]
        self._everyone = np.ones(self.num_envs, np.bool_)
        self._ended = np.zeros(self.num_envs, np.bool_)
        self._cycles = np.zeros(self.num_envs, np.int64)
        self._generators: Generators = ()
        self._seal()

    def reset(
        self, seed: Seeds = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, Any]]:
        """Start all episodes, or those of `options["reset_mask"]` (B,). Without a seed the generators go on.

        Other `options` set quantities that episodes draw, for the episodes that start now only.

        Raises:
            ConfigurationError: options name what no episode draws, or a value that this environment is not made for.
            ResetNeeded: a first reset, or the first one after `configure`, has to start all environments.
        """
        drawn = self._asked(options, ("reset_mask",))
        mask = (options or {}).get("reset_mask")
        envs = self._everyone
        if mask is not None:
            envs = check_mask(mask, self.num_envs, begun=bool(self._generators), alike=self._next is None)
        self._generators = reseeded(self._generators, seed, envs)
        self._restart(envs, drawn)
        return self._observations(), self._infos(self._batch.costs.add(self.game.metrics()))

    def step(self, actions: Mapping[str, Any]) -> Results:
        """Advance by one decision of the agents, whose `actions` are arrays (B, ...).

        Raises:
            ResetNeeded: before the first reset, or for an ended episode when automatic resetting is disabled.
            ValueError: an agent's actions are missing, have a wrong shape, are not finite, or are discrete and not in
                their space. Box actions outside their bounds count as the nearest ones inside.
        """
        if not self._generators:
            raise ResetNeeded("call reset() before step()")
        if self.autoreset_mode == AutoresetMode.DISABLED and self._ended.any():
            listed = np.flatnonzero(self._ended).tolist()
            raise ResetNeeded(
                f'episodes {listed} have ended: call reset(options={{"reset_mask": mask}}) for them first'
            )
        check_agents(actions, self.possible_agents)
        given = {role: self._read(role, actions) for role in self._batch.hands}
        live = ~self._ended
        if self._ended.any():
            self._restart(self._ended, self._drawn)
        rewards = self._batch.step(given, live)
        self._cycles += live
        terminated = live & self._batch.over()
        truncated = live & ~terminated & (self._cycles == self._most)
        if self._next is not None:  # something else is to be played, by all
            truncated = ~terminated
        self._ended = terminated | truncated
        metrics, final = self._batch.costs.add(self.game.metrics()), {}
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._ended.any():
            ended = self._ended
            last = {name: np.array(values) for name, values in metrics.items()}  # the game may go on in its own arrays
            final = {"final_obs": self._observations(), "final_info": last, "_final_obs": ended}
            self._restart(ended, self._drawn)
            metrics = {**metrics, **self.game.metrics()}
        paid = {
            name: rewards[role][:, place]
            for role, hand in self._batch.hands.items()
            for place, name in enumerate(hand.names)
        }
        ends = [{name: marks.copy() for name in self.agents} for marks in (terminated, truncated)]
        return self._observations(), paid, ends[0], ends[1], {**self._infos(metrics), **final}

    def state(self) -> Observation:
        """What all roles played from outside observe, and what episodes hide from them, (B, n): for critics.

        Raises:
            ResetNeeded: before the first reset.
        """
        self.check_begun()
        return self._batch.state()

    @property
    def unwrapped(self) -> AgentsVectorEnv:
        """Itself, as of every other form."""
        return self

    def close(self) -> None:
        """Nothing is open."""

    def _restart(self, envs: BoolArray, drawn: Any) -> None:
        if envs.all():
            self._renew()
        self._begun = True
        self._batch.reset(envs, self._generators, None if self._next is not None else drawn)
        self._cycles[envs] = 0
        self._ended = self._ended & ~envs

    def _read(self, role: Role, actions: Mapping[str, Any]) -> Array:
        """The checked actions (B x A, ...) of a role's agents."""
        hand = self._batch.hands[role]
        read = [hand.reader.batch(actions[name], self.num_envs) for name in hand.names]
        together = np.stack(read, axis=1)
        return together.reshape(-1, *together.shape[2:])

    def _observations(self) -> dict[str, Observation]:
        shown: dict[str, Observation] = {}
        for hand in self._batch.hands.values():
            rows = hand.player.rows()
            shown |= {name: rows[:, place].copy() for place, name in enumerate(hand.names)}
        return shown

    def _infos(self, metrics: dict[str, Array]) -> dict[str, Any]:
        infos: dict[str, Any] = {name: values.copy() for name, values in metrics.items()}
        for hand in self._batch.hands.values():
            masks, due = hand.player.masks(), self._batch.due(hand)
            legal = None if masks is None else masks.reshape(self.num_envs, len(hand.names), -1).astype(np.int8)
            for place, name in enumerate(hand.names):
                infos[name] = {"due": due.copy()}
                if legal is not None:
                    infos[name]["action_mask"] = legal[:, place]
        return infos
