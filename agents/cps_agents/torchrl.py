"""The door for TorchRL: both roles of a problem in a batch of episodes, for self-play and multi-agent learning."""

from __future__ import annotations

from collections.abc import Mapping
from math import lcm
from typing import Any

import numpy as np
import torch

from cps_envs.core.compute.generators import seeded
from cps_envs.core.declare.seeds import MOST_RUNS, training_seed
from cps_envs.core.errors import ConfigurationError, require
from cps_envs.core.game.match import Match
from cps_envs.core.interfaces.outside import Outside
from cps_envs.core.learning.learning_env import LearningVectorEnv
from cps_envs.core.learning.wired_player import WiredPlayer
from cps_envs.core.types import ROLES, Array, Role
from cps_envs.registration import find_problem

try:
    from tensordict import TensorDict, TensorDictBase
    from torchrl.data import Bounded, Categorical, Composite, MultiCategorical, Unbounded
    from torchrl.envs import EnvBase
except ImportError:
    require("torchrl", extra="torchrl", purpose="training with TorchRL")
    raise

MEASURED = 64  # episodes of the pass that measures how inputs are scaled
FIRST = 8  # decisions of an episode from which on first episodes are cut at different times


class DuelEnv(EnvBase):
    """B episodes in which attacker and defender are both learned: a group of agents for each role.

    Entries are `("attacker", "observation")` (B, A, n), `("attacker", "action")`, `("attacker", "reward")` (B, A, 1),
    and the same for the defender. Each agent of a team is paid for its own part. All decide every `frame_skip` steps of
    the game. Inputs are those of `cps_envs.learning_env`: scaled once, with averages, last action and masks.
    `sides[role]` is that environment; its `single_observation_space` says which column is what, and
    `cps_agents.zoo.own.save_network` takes it to keep a network that was trained here.

    The clock's end is `terminated`. Only first episodes are `truncated`, each at a time of its own, so that batches
    have all parts of an episode.
    """

    def __init__(
        self,
        problem: str,
        num_envs: int = 256,
        frame_skip: int = 1,
        *,
        preset: str = "learning",
        adapters: Mapping[Role, str] | None = None,
        seed: int = 0,
        **overrides: Any,
    ) -> None:
        """`adapters` names what the roles are played through; those of their training settings where left out.

        Raises:
            ConfigurationError: a role does not decide every `frame_skip` steps, or a value that cannot be right.
            UnknownNameError: there is no such problem or adapter.
        """
        found = find_problem(problem)
        self.game = found.game(found.config(preset, overrides), num_envs)
        intervals = self.game.decision_interval
        if frame_skip % lcm(*intervals.values()):
            raise ConfigurationError(
                f"frame_skip = {frame_skip} must be a multiple of the decision intervals {intervals}"
            )
        self._frame_skip, self._match = frame_skip, Match(self.game, {})
        super().__init__(device="cpu", batch_size=torch.Size([num_envs]))
        self.sides = {
            role: LearningVectorEnv(
                found,
                role,
                MEASURED,
                preset=preset,
                adapter=(adapters or {}).get(role),
                frame_skip=frame_skip // intervals[role],
                **overrides,
            )
            for role in ROLES
        }
        self._players = {
            role: WiredPlayer(Outside(self.game, role, env.training.adapter), env.wired.wiring, num_envs)
            for role, env in self.sides.items()
        }
        self._make_specs(num_envs)
        self._set_seed(seed)

    def _make_specs(self, num_envs: int) -> None:
        """The specifications of what goes in and out."""
        batch, groups = torch.Size([num_envs]), self._players
        shape = {role: (num_envs, len(player.outside.agents)) for role, player in groups.items()}
        seen = {
            role: Composite(observation=Unbounded((*shape[role], player.wired.columns.size)), shape=shape[role])
            for role, player in groups.items()
        }
        acted = {
            role: Composite(action=_action_spec(player, shape[role]), shape=shape[role])
            for role, player in groups.items()
        }
        paid = {role: Composite(reward=Unbounded((*shape[role], 1)), shape=shape[role]) for role in groups}
        ends = {
            name: Categorical(2, shape=(num_envs, 1), dtype=torch.bool) for name in ("done", "terminated", "truncated")
        }
        self.observation_spec = Composite(seen, shape=batch)
        self.action_spec = Composite(acted, shape=batch)
        self.reward_spec = Composite(paid, shape=batch)
        self.done_spec = Composite(ends, shape=batch)

    def _set_seed(self, seed: int | None) -> None:
        """Number the training run; its episodes are never those of an evaluation."""
        count = self.batch_size[0]
        first = training_seed((seed or 0) % MOST_RUNS)  # TorchRL draws large ones
        self._generators = seeded(range(first, first + count))
        decisions = -(-self.game.horizon // self._frame_skip)
        begins = np.random.default_rng(first).integers(1, decisions + 1, count)
        self._cut: Array = begins if decisions >= FIRST else np.zeros(count, np.int64)

    def _reset(self, tensordict: TensorDictBase | None = None, **_: Any) -> TensorDictBase:
        marks = None if tensordict is None else tensordict.get("_reset", None)
        envs = np.ones(self.batch_size[0], np.bool_) if marks is None else marks.numpy().reshape(-1)
        self._match.reset(envs, self._generators)
        for player in self._players.values():
            player.restart(envs)
        never = torch.zeros((*self.batch_size, 1), dtype=torch.bool)
        ends = {name: never.clone() for name in ("done", "terminated", "truncated")}
        return TensorDict({**self._rows(), **ends}, self.batch_size)

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        game, players = self.game, self._players
        for role, player in players.items():
            player.keep(tensordict[role, "action"].numpy())
        rewards = {role: np.zeros((game.num_envs, len(player.outside.agents))) for role, player in players.items()}
        live, held = np.ones(game.num_envs, np.bool_), dict[Role, Array]()
        for step in range(self._frame_skip):
            live = live & ~game.terminated & (game.elapsed < game.horizon)
            for role, player in players.items():
                if step % game.decision_interval[role] == 0:
                    held[role] = player.act(first=step == 0)
            payoff = self._match.step(held, live, 1)
            for role, player in players.items():
                rewards[role] += np.where(live[:, np.newaxis], player.outside.rewards(payoff), 0.0)
        for player in players.values():
            player.look()
        over, self._cut = game.terminated | (game.elapsed >= game.horizon), self._cut - 1
        cut = (self._cut == 0) & ~over
        ends = {"done": over | cut, "terminated": over, "truncated": cut}
        found = self._rows()
        for role, reward in rewards.items():
            found[role]["reward"] = _tensor(reward[..., np.newaxis])
        marks = {name: torch.from_numpy(marked[:, np.newaxis].copy()) for name, marked in ends.items()}
        return TensorDict({**found, **marks}, self.batch_size)

    def _rows(self) -> dict[str, TensorDict]:
        """What the agents see now."""
        return {
            role: TensorDict({"observation": _tensor(player.rows())}, (*self.batch_size, len(player.outside.agents)))
            for role, player in self._players.items()
        }


def _action_spec(player: WiredPlayer, shape: tuple[int, int]) -> Any:
    """The specification of the agents' actions (B, A, ...)."""
    space, choices = player.wired.adapter.action_space, player.wired.choices
    if not choices:
        return Bounded(-1.0, 1.0, (*shape, *(space.shape or ())))
    if space.shape == ():
        return Categorical(choices[0], shape=shape)
    return MultiCategorical(choices, shape=(*shape, len(choices)))


def _tensor(array: Array) -> torch.Tensor:
    return torch.from_numpy(array.astype(np.float32))
