"""A role as ordinary learners like it: a Gymnasium vector environment with a row for each agent of each episode."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from cps_envs.core.compute.generators import seeded
from cps_envs.core.declare.actions import ActionReader
from cps_envs.core.declare.seeds import SEEDS_PER_RUN, training_seed
from cps_envs.core.declare.training import Training
from cps_envs.core.errors import ConfigurationError, shown
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.info import batch_info
from cps_envs.core.interfaces.options import check_count, check_options
from cps_envs.core.interfaces.outside import Outside
from cps_envs.core.learning.beside import Beside
from cps_envs.core.learning.untrained import Untrained
from cps_envs.core.learning.wired_player import WiredPlayer
from cps_envs.core.learning.wiring import Scaling, WiredBox, Wiring, scaling_of
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import SIGN, Array, BoolArray, FloatArray, Generators, Observation, Role, other

APART = {"opponent", "num_envs", "practised", "sampled", "total_timesteps", "ppo"}  # arguments, or for learners
SETTINGS = {entry.name for entry in fields(Training)} - APART
Step = tuple[Observation, FloatArray, BoolArray, BoolArray, dict[str, Any]]
FEWEST_STAGGERED = 8  # decisions of an episode from which on starts are staggered
MOST_SAMPLES = 50_000  # rows that the scaling is taken of


class LearningVectorEnv(VectorEnv[Observation, Any, Array]):
    """B episodes with A agents each, as B x A rows that one network can play, all agents of an episode side by side.

    - The agents act through an adapter, and keep an action for `frame_skip` decisions of the role.
    - Inputs are scaled once, by what an untrained policy meets in a first pass. There are no running statistics.
    - Each agent of a defending team is paid for its own part; the parts sum to minus the payoff.
    - Episodes may be those that teach most, see `Training.practised`; fields that you set yourself are as you set them.
    - Episodes start at different times, so that every batch has all parts of an episode.
    - The clock's end is `terminated`: the observation tells the time, and no value lies beyond. Nothing is truncated.
    - Ended episodes start anew at once (`AutoresetMode.SAME_STEP`). `info["final_info"]` has `episode` with the role's
      undiscounted return `r` and length `l`, and the game's metrics; each row of an ended episode has them.
    - `seed` numbers training runs. Its episodes lie beyond all seeds of evaluations, see `core.declare.seeds`.

    `single_observation_space` carries the wiring, see `wiring.WiredBox`. `active()` and `privileged()` are
    for learners that can use them.
    """

    def __init__(
        self,
        problem: Problem,
        role: Role,
        num_envs: int | None = None,
        *,
        training: Training | None = None,
        preset: str = "learning",
        opponent: PolicyReference | None = None,
        seed: int = 0,
        scaling: Scaling | None = None,
        copies: int = 1,
        num_threads: int = 1,
        **options: Any,
    ) -> None:
        """`options` are settings of `Training`, such as `frame_skip`, and fields of the configuration.

        What is left out is as `training` says, which is `problem.training` if left out itself.

        `scaling` is mean and deviation of the inputs of a network that is to go on learning; else they are measured.
        With `copies` above 1, episodes b, b + num_envs / copies, ... begin with equal generators, and all at the same
        time: for learners that play an episode several times.

        Raises:
            ConfigurationError: a value that cannot be right.
            UnknownNameError: there is no such adapter.
        """
        self.problem, self.role = problem, role
        settings = {name: options.pop(name) for name in SETTINGS if name in options} | {"num_envs": num_envs}
        self.training = _changed(training or problem.training.get(role, Training()), settings)
        self.preset, self.overrides = preset, options
        practised, met = (self.training.practised, self.training.opponent) if preset == "learning" else ({}, "")
        self.config = problem.config(preset, {**practised, **options})
        self.opponent = (met or problem.opponents[preset][other(role)]) if opponent is None else opponent
        self.episodes = check_count("num_envs", self.training.num_envs)
        self._match = problem.match(self.config, self.episodes, {other(role): self.opponent})
        self.game = self._match.game
        self.game.use_threads(check_count("num_threads", num_threads))
        self._run = _number("seed", seed)
        self.copies, self._start = check_count("copies", copies), 0
        if self.episodes % self.copies:
            raise ConfigurationError(f"num_envs = {self.episodes} must be a multiple of copies = {self.copies}")
        self.outside = Outside(self.game, role, self.training.adapter)
        self._beside: Beside | None = None
        if self.training.relative:
            shared = (self.config, self.episodes, role, self.opponent, self.training.adapter)
            self._beside = Beside(problem, *shared)
        self.adapter = self.outside.adapter
        self.agents = len(self.adapter.agents)
        self.untrained = Untrained(self.adapter, self.training, self.training.frame_skip)
        self.num_envs = self.episodes * self.agents
        self.metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}
        self.single_action_space = self.adapter.action_space
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._reader = ActionReader(self.single_action_space)
        self._paid = np.zeros((self.episodes, self.agents))  # so far, of which `pay_power` is taken
        self._returns, self._lengths = np.zeros(self.episodes), np.zeros(self.episodes, np.int64)
        self._generators: Generators = ()
        self._everyone = np.ones(self.episodes, np.bool_)
        self._wire(self._wiring(scaling or ((), ())))
        self._started = False
        if scaling is None:
            self._wire(self._wiring(self._measured()))

    def _wiring(self, scaled: Scaling) -> Wiring:
        """The wiring that the training settings ask for."""
        masked = self.outside.adapter.masked and self.game.action_mask(self.role) is not None
        shared = {entry.name for entry in fields(Wiring)} & {entry.name for entry in fields(Training)}
        settings = {name: getattr(self.training, name) for name in shared}
        mean, deviation = scaled
        return Wiring(self.problem.name, self.role, masked=masked, mean=mean, deviation=deviation, **settings)

    def _wire(self, wiring: Wiring) -> None:
        self._player = WiredPlayer(self.outside, wiring, self.episodes)
        self.wired = self._player.wired
        self.single_observation_space = WiredBox(self.wired.columns, wiring, self.untrained)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start all episodes, at different times. `seed` numbers the training run, 0 to 8,999; None: the one given.

        `options["start"]` numbers the starts of a run, which have episodes of their own; 0 if left out.

        Raises:
            ConfigurationError: the seed or the start is no whole number, or negative.
        """
        check_options(options)
        if seed is not None:
            self._run = _number("seed", seed[0] if isinstance(seed, Sequence) else seed)
        self._start = _number("start", (options or {}).get("start", 0))
        self._begin()
        if self.copies == 1:
            for _ in self._stagger():
                pass
        self._clear(self._everyone)
        self._started = True
        return self._rows(), {}

    def step(self, actions: Any) -> Step:
        """Advance every episode by `frame_skip` decisions of the role, or to its end, under the agents' actions.

        Raises:
            ResetNeeded: before the first reset.
            ValueError: the actions have a wrong shape, are not finite or lie outside the action space.
        """
        if not self._started:
            raise ResetNeeded("call reset() before step()")
        checked = self._reader.batch(actions, self.num_envs)
        reward, payoff, ended = self._advance(checked)
        self._returns += SIGN[self.role] * payoff
        self._lengths += 1
        learned = self._learned(reward)
        info = self._ends(ended) if ended.any() else {}
        done = np.repeat(ended, self.agents)
        return self._rows(), learned.reshape(-1), done, np.zeros(self.num_envs, np.bool_), info

    @property
    def decisions(self) -> int:
        """How often an agent decides in an episode that the clock ends."""
        held = self.game.decision_interval[self.role] * self.wired.wiring.frame_skip
        return -(-self.game.horizon // held)

    def active(self) -> BoolArray:
        """The rows (B x A,) that are there and whose action has an effect now."""
        return self._player.active().reshape(-1)

    def privileged(self) -> Observation:
        """What the episodes hide, (B x A, p), for value functions in training only."""
        shown = self.outside.privileged()
        return shown.reshape(self.num_envs, shown.shape[2])

    def action_masks(self) -> BoolArray:
        """Legal actions (B x A, k).

        Raises:
            AttributeError: all actions are legal.
        """
        count = self.wired.columns.mask
        if count == 0:
            raise AttributeError(f"the {self.role} of {self.problem.name} has no action masks here")
        return self._rows()[:, -count:] > 0

    def _rows(self) -> Observation:
        return self._player.rows().reshape(self.num_envs, -1)

    def _begin(self) -> None:
        first, count = training_seed(self._run), self.episodes // self.copies
        places = (self._start * count + np.arange(self.episodes) % count) % SEEDS_PER_RUN
        self._generators = seeded([first + place for place in places.tolist()])
        self._reset(self._everyone)
        self._player.begin()

    def _advance(self, actions: Array) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Keep actions (B x A, ...); the agents' rewards (B, A), the payoff (B,), and the episodes (B,) that ended."""
        game, interval = self.game, self.game.decision_interval[self.role]
        shape = self.adapter.action_space.shape or ()
        chosen = actions.reshape(self.episodes, self.agents, *shape)
        self._player.keep(chosen)
        reward, total, live = np.zeros((self.episodes, self.agents)), np.zeros(self.episodes), self._everyone
        for decision in range(self.wired.wiring.frame_skip):
            if decision > 0:
                live = live & ~game.terminated & (game.elapsed < game.horizon)
                if not live.any():
                    break
            payoff = self._match.step({self.role: self._player.act(first=decision == 0)}, live, interval)
            reward += np.where(live[:, np.newaxis], self.outside.rewards(payoff), 0.0)
            total += payoff
            if self._beside is not None:
                reward -= self._beside.step(live)
        self._player.look()
        return reward, total, game.terminated | (game.elapsed >= game.horizon)

    def _learned(self, reward: FloatArray) -> FloatArray:
        """What learners are paid, (B, A): the rewards, or the increase of a power of their sum so far."""
        power = self.training.pay_power
        if power == 1.0:
            return reward
        before = np.maximum(SIGN[self.role] * self._paid, 0.0)
        self._paid = self._paid + reward
        after = np.maximum(SIGN[self.role] * self._paid, 0.0)
        gained: FloatArray = SIGN[self.role] * ((1.0 + after) ** power - (1.0 + before) ** power)
        return gained

    def _ends(self, ended: BoolArray) -> dict[str, Any]:
        """Start ended episodes anew; their last rows and metrics as Gymnasium's `final_*` entries."""
        rows, last = np.repeat(ended, self.agents), self._rows()
        final_obs = np.full(self.num_envs, None, object)
        for row in np.flatnonzero(rows):
            final_obs[row] = last[row]
        final = batch_info(self.game, self.role, ended)
        shared: dict[str, Any] = {name: np.repeat(values, self.agents, axis=0) for name, values in final.items()}
        episode = {"r": np.where(ended, self._returns, 0.0), "l": np.where(ended, self._lengths, 0)}
        shared["episode"] = {name: np.repeat(values, self.agents) for name, values in episode.items()}
        shared["_episode"] = rows
        self._restart(ended)
        return {"final_obs": final_obs, "_final_obs": rows, "final_info": shared, "_final_info": rows.copy()}

    def _reset(self, envs: BoolArray) -> None:
        if self._beside is not None:
            self._beside.reset(envs, self._generators)
        self._match.reset(envs, self._generators)

    def _restart(self, envs: BoolArray) -> None:
        self._reset(envs)
        self._player.restart(envs)
        self._clear(envs)

    def _clear(self, envs: BoolArray) -> None:
        self._paid[envs], self._returns[envs], self._lengths[envs] = 0.0, 0.0, 0

    def _stagger(self) -> Iterator[tuple[Observation, BoolArray]]:
        """Let an untrained policy play until each episode has begun at a time of its own; yields rows, and who acts."""
        decisions = self.decisions
        if decisions < FEWEST_STAGGERED:
            yield self._rows(), self.active()
            return
        generator = np.random.default_rng(training_seed(self._run) + self._start)
        begins = generator.integers(0, decisions, self.episodes)
        for decision in range(decisions):
            rows = self._rows()
            yield rows, self.active()
            last = rows[:, self.wired.columns.scaled :][:, : self.wired.columns.last_action]
            masks = rows[:, -self.wired.columns.mask :] > 0 if self.wired.columns.mask else None
            drawn = self.untrained.draw(last, masks, generator)
            action = drawn.reshape(self.num_envs, *(self.single_action_space.shape or ()))
            *_, ended = self._advance(self._reader.batch(action, self.num_envs))
            again = ended | (begins == decision)
            if again.any():
                self._restart(again)

    def _measured(self) -> Scaling:
        """Mean and deviation of the inputs that an untrained policy meets."""
        self._begin()
        met = [rows[active] for rows, active in self._stagger()]
        columns = np.concatenate(met)[:, : self.wired.columns.scaled]
        if len(columns) == 0:
            raise ConfigurationError(
                "no agent was active in a first pass, so there is nothing to learn: name another opponent or adapter, "
                "or make episodes longer"
            )
        return scaling_of(columns[:: len(columns) // MOST_SAMPLES + 1])


def _changed(training: Training, settings: Mapping[str, Any]) -> Training:
    """Training settings with what a caller has set otherwise."""
    changed: dict[str, Any] = {}
    for name, each in settings.items():
        if each is not None:
            changed[name] = tuple(each) if isinstance(each, list) else each
    return replace(training, **changed)


def _number(name: str, value: Any) -> int:
    """A whole number from 0 on."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 0:
        raise ConfigurationError(f"{name} = {shown(value)} must be a whole number from 0 on")
    return int(value)
