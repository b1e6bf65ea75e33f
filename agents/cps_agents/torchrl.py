"""Train with TorchRL: both roles of a problem, or a team, in a batch of episodes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

from cps_envs.core.declare.actions import choices_of
from cps_envs.core.declare.seeds import MOST_RUNS, training_seed
from cps_envs.core.errors import require
from cps_envs.core.interfaces.agents_vector_env import AgentsVectorEnv
from cps_envs.core.interfaces.parallel_env import RolesVectorEnv
from cps_envs.core.interfaces.swarm_env import SwarmVectorEnv
from cps_envs.core.types import ROLES, Array, Role
from cps_envs.registration import find_problem

try:
    from tensordict import TensorDict, TensorDictBase
    from torchrl.data import Bounded, Categorical, Composite, MultiCategorical, Unbounded
    from torchrl.envs import EnvBase
except ImportError:
    require("torchrl", extra="torchrl", purpose="training with TorchRL")
    raise

FIRST = 8  # decisions of an episode from which on first episodes are cut at different times


class GroupsEnv(EnvBase):
    """B episodes of a batch of agents `envs`, with a group of agents for each role that is played from outside.

    Entries are `("attacker", "observation")` (B, A, n), `("attacker", "action")`, `("attacker", "reward")` (B, A, 1),
    and the same for the defender. `group_map` has the agents of each group. `cps_agents.save_network(folder, env.envs,
    layers, agent="attacker_0")` keeps a network that was trained here.

    The clock's end is `terminated`. Only first episodes are `truncated`, each at a time of its own, so that batches
    have all parts of an episode.
    """

    def __init__(self, envs: AgentsVectorEnv, *, seed: int = 0) -> None:
        self.envs = envs
        super().__init__(device="cpu", batch_size=torch.Size([envs.num_envs]))
        self.group_map = {role: list(envs.agents_of[role]) for role in ROLES if role in envs.agents_of}
        self._make_specs(envs.num_envs)
        self._set_seed(seed)

    def _make_specs(self, num_envs: int) -> None:
        """The specifications of what goes in and out."""
        batch, envs = torch.Size([num_envs]), self.envs
        shape = {role: (num_envs, len(names)) for role, names in self.group_map.items()}
        first = {role: names[0] for role, names in self.group_map.items()}
        size = {role: int(np.prod(envs.observation_space(name).shape or ())) for role, name in first.items()}
        seen = {role: Composite(observation=Unbounded((*shape[role], size[role])), shape=shape[role]) for role in first}
        acted = {
            role: Composite(action=_action_spec(envs.action_space(name), shape[role]), shape=shape[role])
            for role, name in first.items()
        }
        paid = {role: Composite(reward=Unbounded((*shape[role], 1)), shape=shape[role]) for role in first}
        ends = {
            name: Categorical(2, shape=(num_envs, 1), dtype=torch.bool) for name in ("done", "terminated", "truncated")
        }
        self.observation_spec = Composite(seen, shape=batch)
        self.action_spec = Composite(acted, shape=batch)
        self.reward_spec = Composite(paid, shape=batch)
        self.done_spec = Composite(ends, shape=batch)

    def _set_seed(self, seed: int | None) -> None:
        """Number the training run; its episodes are never those of an evaluation."""
        self._first: int | None = training_seed((seed or 0) % MOST_RUNS)  # TorchRL draws large ones
        decisions = -(-self.envs.game.horizon // self.envs.interval)
        begins = np.random.default_rng(self._first).integers(1, decisions + 1, self.batch_size[0])
        self._cut: Array = begins if decisions >= FIRST else np.zeros(self.batch_size[0], np.int64)

    def _reset(self, tensordict: TensorDictBase | None = None, **_: Any) -> TensorDictBase:
        marks = None if tensordict is None else tensordict.get("_reset", None)
        chosen = {} if marks is None or self._first is not None else {"reset_mask": marks.numpy().reshape(-1)}
        shown, _info = self.envs.reset(seed=self._first, options=chosen)
        self._first = None
        never = torch.zeros((*self.batch_size, 1), dtype=torch.bool)
        ends = {name: never.clone() for name in ("done", "terminated", "truncated")}
        return TensorDict({**self._rows(shown), **ends}, self.batch_size)

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        actions = {
            name: tensordict[role, "action"][:, place].numpy()
            for role, names in self.group_map.items()
            for place, name in enumerate(names)
        }
        shown, rewards, terminated, _, _info = self.envs.step(actions)
        over, self._cut = next(iter(terminated.values())), self._cut - 1
        cut = (self._cut == 0) & ~over
        ends = {"done": over | cut, "terminated": over, "truncated": cut}
        found = self._rows(shown)
        for role, names in self.group_map.items():
            found[role]["reward"] = _tensor(np.stack([rewards[name] for name in names], axis=1)[..., np.newaxis])
        marks = {name: torch.from_numpy(marked[:, np.newaxis].copy()) for name, marked in ends.items()}
        return TensorDict({**found, **marks}, self.batch_size)

    def _rows(self, shown: Mapping[str, Array]) -> dict[str, TensorDict]:
        """What the agents see now."""
        return {
            role: TensorDict(
                {"observation": _tensor(np.stack([shown[name] for name in names], axis=1))},
                (*self.batch_size, len(names)),
            )
            for role, names in self.group_map.items()
        }


class DuelEnv(GroupsEnv):
    """B episodes in which attacker and defender are both learned: a group of agents for each role.

    It is the batched `parallel_env(num_envs=B)` of the problem, which is `envs`: a step lasts until the first of the
    agents decides again, and each agent of a team gets its own part of the reward.
    """

    def __init__(self, problem: str, num_envs: int = 256, *, seed: int = 0, **options: Any) -> None:
        """`options` are those of `parallel_env`, such as `preset`, `adapters` and `frame_skip`.

        Raises:
            ConfigurationError: a value that cannot be right.
            UnknownNameError: there is no such problem or adapter.
        """
        super().__init__(RolesVectorEnv(find_problem(problem), num_envs, autoreset="disabled", **options), seed=seed)


class TeamEnv(GroupsEnv):
    """B episodes of a team against a fixed opponent: the batched `swarm_env(role, num_envs=B)`, which is `envs`.

    The team is the one group, named after its role. A step is one decision of the team.
    """

    def __init__(
        self, problem: str, num_envs: int = 256, *, role: Role = "defender", seed: int = 0, **options: Any
    ) -> None:
        """`options` are those of `swarm_env`, such as `opponent`, `adapter`, `shared_pay` and `flat`.

        Raises:
            ConfigurationError: a value that cannot be right.
            TypeError: the role has no team.
            UnknownNameError: there is no such problem, opponent or adapter.
        """
        envs = SwarmVectorEnv(find_problem(problem), role, num_envs, autoreset="disabled", **options)
        super().__init__(envs, seed=seed)


def _action_spec(space: Any, shape: tuple[int, int]) -> Any:
    """The specification of the agents' actions (B, A, ...)."""
    choices = choices_of(space)
    if not choices:
        return Bounded(-1.0, 1.0, (*shape, *(space.shape or ())))
    if space.shape == ():
        return Categorical(choices[0], shape=shape)
    return MultiCategorical(choices, shape=(*shape, len(choices)))


def _tensor(array: Array) -> torch.Tensor:
    return torch.from_numpy(array.astype(np.float32))
