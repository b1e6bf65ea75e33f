"""A role as ordinary learners train on it, on a GPU: rows, rewards and ends as torch tensors. Experimental."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from cps_envs.core.compute.generators import seeded
from cps_envs.core.compute.gpu import Table, check_card
from cps_envs.core.declare.seeds import training_seed
from cps_envs.core.errors import ConfigurationError, MissingExtraError, shown
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.configured import stage_of
from cps_envs.core.interfaces.learning_env import FEWEST_STAGGERED, LearningVectorEnv, _number
from cps_envs.core.learning.card import Card, batched, card_of
from cps_envs.core.learning.scaling import random_actions
from cps_envs.core.learning.side import LearningSide
from cps_envs.core.types import Role

PLAIN: dict[str, Any] = {
    "autoreset": AutoresetMode.SAME_STEP,
    "copies": 1,
    "evaluation": False,
    "flat": False,
    "num_threads": 1,
    "per_agent": True,
}
OPTIONS = ("start", "staggered")


class CardVectorEnv(LearningVectorEnv):
    """`LearningVectorEnv` with the episodes of the CPU, bit for bit, played by the threads of a GPU.

    One launch is a decision: the steps of the game, the other role's policy, the start of new episodes where some have
    ended, and the inputs of the network. What `reset` and `step` return are tensors that lie where the card writes, so
    that the next step writes over them: copy what you keep. Actions are a tensor (num_envs, ...) on the card; those
    outside the action space count as the nearest ones inside. `final_info` has `episode` alone, no metrics.
    """

    def __init__(self, problem: Problem, role: Role, num_envs: int | None = None, **options: Any) -> None:
        """See `LearningVectorEnv`.

        Raises:
            ConfigurationError: there is no card; an option that only the CPU has; or an adapter or an opponent that
                cannot come along.
            MissingExtraError: torch or numba-cuda is missing.
        """
        check_card()
        try:
            import torch
        except ImportError as error:
            raise MissingExtraError('device = "cuda" needs torch: pip install "cps_envs[gpu,train]"') from error
        for name, plain in PLAIN.items():
            if options.get(name, plain) not in (plain, getattr(plain, "value", plain)):
                raise ConfigurationError(f"{name} = {shown(options[name])} is not for a GPU: leave it, or device, out")
        self._torch: Any = torch
        super().__init__(problem, role, num_envs, **options)
        for name, found in (("relative", self.training.relative), ("pay_power", self.training.pay_power != 1.0)):
            if found:
                raise ConfigurationError(f"{name} is not for a GPU: leave it, or device, out")
        self._table: Table | None = None

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start all episodes, see `LearningVectorEnv.reset`, of whose options `start` and `staggered` are known here.

        Raises:
            ConfigurationError: the seed or the start is no whole number, or negative; or there is another option.
        """
        given = dict(options or {})
        if odd := sorted(set(given) - set(OPTIONS)):
            raise ConfigurationError(f"options = {shown(odd)} are not for a GPU: leave them, or device, out")
        self._run = self._run if seed is None else _number("seed", seed)
        self._start = _number("start", given.get("start", 0))
        training_seed(self._run)
        self._table = self._made()
        torch, tensors = self._torch, self._table.tensors
        self._cut = torch.zeros_like(tensors["clock.over"])
        tensors["clock.over"].fill_(True)  # so that nothing moves before the first episodes begin
        tensors["learner.force"].fill_(True)
        self._table.play()
        tensors["learner.force"].fill_(False)
        self._stagger(given.get("staggered", self._staggered))
        return self._rows(), {}

    def _made(self) -> Table:
        """The arrays of a new match, on the card."""
        wiring = self.wired.wiring
        scaling, rival = (wiring.mean, wiring.deviation), self.opponent or "none"

        def card(count: int) -> Card:
            stage = stage_of(self._stage.setting, rival, count, scaling=scaling, **self._form)
            assert isinstance(stage.side, LearningSide)
            return card_of(stage.match, stage.side, seeded(np.resize(self._seeds(), count).tolist()))

        made, own = card(self.episodes), batched(card(1).world, card(2).world)
        return Table(made.decide, made.world, own, self.episodes)

    def _stagger(self, wanted: bool) -> None:
        assert self._table is not None
        if not wanted or self.decisions < FEWEST_STAGGERED:
            return
        torch, tensors = self._torch, self._table.tensors
        generator = np.random.default_rng(training_seed(self._run) + self._start)
        begins = generator.integers(0, self.decisions, self.episodes)
        assert isinstance(self._side, LearningSide)
        for decision in range(self.decisions):
            actions = torch.from_numpy(random_actions(self._side, generator))
            tensors["learner.force"].copy_(torch.from_numpy(begins == decision))
            self._take(actions)
        tensors["learner.force"].fill_(False)
        self._cut = tensors["learner.length"] > 0
        for name in ("total", "length"):
            tensors[f"learner.{name}"].zero_()

    def _take(self, actions: Any) -> None:
        """Play a decision."""
        assert self._table is not None
        chosen = self._table.tensors["learner.chosen"]
        chosen.copy_(actions.reshape(chosen.shape))
        space: Any = self.single_action_space
        chosen.clamp_(0, space.n - 1) if hasattr(space, "n") else chosen.clamp_(-1.0, 1.0)
        self._table.play()

    def step(self, actions: Any) -> Any:
        """Hold actions (num_envs, ...) for a decision: rows, rewards, terminated, truncated and info.

        Raises:
            ResetNeeded: before the first reset.
        """
        if self._table is None:
            from gymnasium.error import ResetNeeded

            raise ResetNeeded("call reset() before step()")
        self._take(actions)
        tensors = self._table.tensors
        ended = tensors["learner.terminated"]
        whole = ended & ~self._cut
        self._cut = self._cut & ~ended
        episode = {"r": tensors["learner.returned"], "l": tensors["learner.lasted"]}
        info = {"final_info": {"episode": episode, "_episode": whole}, "_final_info": ended}
        return self._rows(), tensors["learner.rewards"], ended, self._torch.zeros_like(ended), info

    def active(self) -> Any:
        """The rows whose action has an effect now, (num_envs,)."""
        assert self._table is not None
        return self._table.tensors["learner.active"].reshape(self.num_envs)

    def _rows(self) -> Any:
        assert self._table is not None
        return self._table.tensors["learner.inputs"].reshape(self.num_envs, -1)
