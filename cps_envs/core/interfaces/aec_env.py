"""Both roles of a game in turns: `pettingzoo.AECEnv`, which says what was wrong when it was wrong."""

from __future__ import annotations

from typing import Any

from gymnasium.error import ResetNeeded
from pettingzoo.utils.conversions import parallel_to_aec_wrapper

from cps_envs.core.errors import shown
from cps_envs.core.interfaces.agents_env import AgentsEnv
from cps_envs.core.types import Observation


class RolesAECEnv(parallel_to_aec_wrapper[str, Observation, Any]):
    """An `AgentsEnv` whose agents hand over their actions one after the other; these still count as simultaneous."""

    env: AgentsEnv

    def __init__(self, env: AgentsEnv) -> None:
        super().__init__(env)
        self.agents: list[str] = []

    def step(self, action: Any) -> None:
        """Take the action of `agent_selection`; the game goes on after that of the last agent. None once it has ended.

        Raises:
            ResetNeeded: no episode is running.
            ValueError: the action has a wrong shape, is not finite, or is discrete and not in the agent's space; or it
                is not None though the episode has ended. A Box action outside its bounds counts as the nearest one
                inside.
        """
        self._check_running()
        agent = self.agent_selection
        if not (self.terminations[agent] or self.truncations[agent]):
            self.env.check_action(agent, action)
        elif action is not None:
            raise ValueError(f"action = {shown(action, 60)}: the episode of {agent} has ended, so its action is None")
        super().step(action)

    def last(self, observe: bool = True) -> tuple[Observation | None, float, bool, bool, dict[str, Any]]:
        """Observation, reward since its last turn, ends and info of the agent whose turn it is.

        Raises:
            ResetNeeded: no episode is running.
        """
        self._check_running()
        found: tuple[Observation | None, float, bool, bool, dict[str, Any]]
        found = super().last(observe)  # type: ignore[no-untyped-call]
        return found

    def observe(self, agent: str) -> Observation:
        """What an agent has seen last, (n,).

        Raises:
            ResetNeeded: before the first reset.
            UnknownNameError: there is no such agent.
        """
        self.env.check_begun()
        self.env.observation_space(agent)
        seen: Observation = super().observe(agent)  # type: ignore[no-untyped-call]
        return seen

    def _check_running(self) -> None:
        if not self.agents:
            raise ResetNeeded("no episode is running: call reset() first, and again after all agents have ended")
