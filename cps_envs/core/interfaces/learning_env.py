"""A role as ordinary learners train on it: its vector environment, with episodes that only training sees."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import fields, replace
from typing import Any, cast

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

from cps_envs.core.compute.generators import Lazy, seeded
from cps_envs.core.declare.config import check_count
from cps_envs.core.declare.objective import is_own
from cps_envs.core.declare.seeds import SEEDS_PER_BLOCK, SEEDS_PER_RUN, training_seed, validation_seed
from cps_envs.core.declare.training import Training
from cps_envs.core.errors import ConfigurationError, shown
from cps_envs.core.game.configuration_file import with_file
from cps_envs.core.game.problem import LEARNING, Problem
from cps_envs.core.interfaces.configured import Stage
from cps_envs.core.interfaces.info import batch_info
from cps_envs.core.interfaces.options import reseeded
from cps_envs.core.interfaces.vector_env import RoleVectorEnv
from cps_envs.core.learning.beside import Beside
from cps_envs.core.learning.outside import Outside
from cps_envs.core.learning.past import Arrays, Past, moves, start_again
from cps_envs.core.learning.scaling import random_actions
from cps_envs.core.learning.setting import Setting, setting
from cps_envs.core.learning.side import LearningSide
from cps_envs.core.learning.wiring import Scaling, Wired, WiredBox
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import SIGN, Array, BoolArray, FloatArray, Observation, Role

PLAIN: dict[str, Any] = {"pay_power": 1.0, "relative": False}  # settings of evaluations
APART = {"opponent", "num_envs", "practised", "sampled", "total_timesteps", "ppo"}  # arguments, or for learners
SETTINGS: Collection[str] = {entry.name for entry in fields(Training)} - APART
STARTS = ("start", "staggered")  # options of `reset`
OPTIONS = ("reset_mask", *STARTS)
TALLIES = ("paid", "returns", "lengths", "cut")  # what is counted of episodes; a past has it as it is
FEWEST_STAGGERED = 8  # decisions of an episode from which on starts are staggered


class LearningVectorEnv(RoleVectorEnv):
    """The vector environment of a role with a row for each agent, B x A of them, and episodes for training.

    What `RoleVectorEnv` shows through `interface="learning"` is the same here. What differs:

    - Each agent of a team is a row with its own part of the reward, or with `shared_pay` the whole.
      `per_agent=False` makes one row of them.
    - `seed` numbers training runs. Its episodes lie beyond all seeds of evaluations, see `core.declare.seeds`.
    - Episodes start at different times, so that every batch has all parts of an episode.
    - Ended episodes restart at once (`autoreset="same_step"`). `info["final_info"]` has `episode` with the role's
      undiscounted return `r` and length `l`, and the game's metrics; each row of an ended episode has them. The
      mask `_episode` leaves out episodes whose beginning was played before `reset` returned.
    - Rewards may be shaped, see `Training.pay_power` and `Training.relative`, and so may episodes, see
      `Training.practised`; fields that you set yourself are as you set them.

    With `evaluation=True` the same inputs, of the same scale, and actions are for judging: each `reset` starts with the
    same validation episodes, all at their first step, and the next ones of the batch follow as these end. Their
    rewards are those of the role, in the configuration as it is.

    `active()` and `privileged()` are for learners that can use them.
    """

    outside: Outside
    wired: Wired
    adapter: Adapter

    def __init__(
        self,
        problem: Problem,
        role: Role,
        num_envs: int | None = None,
        *,
        training: Training | None = None,
        preset: str | None = None,
        opponent: PolicyReference | None = None,
        seed: int = 0,
        scaling: Scaling | WiredBox | None = None,
        copies: int = 1,
        evaluation: bool = False,
        num_threads: int = 1,
        per_agent: bool = True,
        flat: bool = False,
        autoreset: str | AutoresetMode = AutoresetMode.SAME_STEP,
        interface: str = LEARNING,
        **options: Any,
    ) -> None:
        """`options` are settings of `Training`, such as `frame_skip`, and fields of the configuration.

        What is left out is as `training` says, which is `problem.training` if left out itself.

        `scaling` is mean and deviation of the inputs of a network that is to go on learning, or its observation space.
        With `copies` above 1,
        episodes b, b + num_envs / copies, ... begin with equal generators, and all at the same time: for learners that
        play an episode several times.

        Raises:
            ConfigurationError: a value that cannot be right.
            UnknownNameError: there is no such adapter.
        """
        if interface != LEARNING:
            raise ConfigurationError(
                f'interface = {shown(interface)} is not for training environments, which have "{LEARNING}": leave it '
                "out, or take gymnasium.make_vec"
            )
        self.problem, self.role = problem, role
        self._base = training or problem.training.get(role, Training())
        self.evaluation = evaluation
        if evaluation:
            self._base = replace(self._base, **PLAIN)
        self._staggered = copies == 1 and not evaluation
        self._run, self._start = _number("seed", seed), 0
        super().__init__(
            self._base.num_envs if num_envs is None else num_envs,
            preset=preset,
            opponent=opponent,
            interface=LEARNING,
            per_agent=per_agent,
            flat=flat,
            scaling=scaling,
            autoreset=autoreset,
            num_threads=num_threads,
            **options,
        )
        self.copies = check_count("copies", copies)
        if self.episodes % self.copies:
            raise ConfigurationError(f"num_envs = {self.episodes} must be a multiple of copies = {self.copies}")
        self._played = np.zeros(self.episodes, np.int64)  # episodes of an evaluation that have begun since the reset
        self._cut = np.zeros(self.episodes, np.bool_)  # whose beginning nobody has played
        self._paid = np.zeros((self.episodes, self.agents))  # so far, of which `pay_power` is taken
        self._returns, self._lengths = np.zeros(self.episodes), np.zeros(self.episodes, np.int64)
        self._past: Past | None = None
        self._seal()

    def _use(self, stage: Stage) -> None:
        super()._use(stage)
        side, training = self._side, self.training
        assert isinstance(side, LearningSide)
        assert stage.opponent is not None
        vars(self).update(outside=side.outside, wired=side.wired, adapter=side.outside.adapter)
        self._player, self._beside = side.player, None
        if training.relative:
            given = (self.problem, stage.config, self.episodes, self.role, stage.opponent)
            self._beside = Beside(*given, training.adapter)

    def _setting(self, preset: str | None, interface: str | None, options: dict[str, Any]) -> Setting:
        preset, options = with_file(self.problem, preset, options)
        preset = self.problem.usual_preset if preset is None else preset
        practised = self._base.practised if preset == LEARNING else {}
        mixed = {**practised, **options}
        found = setting(self.problem, self.role, preset, interface, mixed, self._base, SETTINGS)
        if self.evaluation and practised:
            plain = setting(self.problem, self.role, preset, interface, options, self._base, SETTINGS)
            found = replace(plain, practised=found.config)
        self.training = found.training
        own = {name: value for name, value in found.overrides.items() if name in options}
        return replace(found, overrides=own)  # what a trained network is played in

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start all episodes, at different times. `seed` numbers the training run, 0 to 8,999; None: the one given.

        With `evaluation` it numbers a block of validation episodes, 0 to 99, and nothing is staggered.

        `options["start"]` numbers the starts of a run, which have episodes of their own; 0 if left out. With
        `options["staggered"]` false all episodes are at their first step. With
        `options["reset_mask"]` only the marked episodes start, as in `RoleVectorEnv`. Other options set quantities that
        the episodes draw which start now.

        Raises:
            ConfigurationError: the seed or the start is no whole number, or negative; seed, start or staggered stand
                beside a reset_mask; or options name what no episode draws, or a value that this environment is not
                made for.
        """
        drawn = self._asked(options, OPTIONS)
        if (options or {}).get("reset_mask") is not None:
            named = next((name for name in STARTS if name in (options or {})), None if seed is None else "seed")
            if named is not None:
                raise ConfigurationError(
                    f"{named} is for all episodes of a run, and reset_mask starts some of them: leave one of them out"
                )
            return super().reset(options=options)
        start, staggered = (options or {}).get("start", 0), (options or {}).get("staggered", self._staggered)
        if not isinstance(staggered, bool):
            raise ConfigurationError(f"staggered = {shown(staggered)} must be True or False")
        alone = seed[0] if isinstance(seed, (list, tuple)) and len(seed) == 1 else seed
        run = self._run if seed is None else _number("seed", alone)
        training_seed(run)
        self._run, self._start = run, _number("start", start)
        self._played[:] = 0
        self._generators = seeded(self._seeds())
        self._once = drawn
        try:
            self._renew()
            super()._restart(self._everyone)
            self._stagger(staggered)
        finally:
            self._once = None
        return self._side.observe(), batch_info(self._side, self._costs.add(self.game.metrics()))

    def active(self) -> BoolArray:
        """The rows that are there and whose action has an effect now, (num_envs,).

        Raises:
            ResetNeeded: before the first reset.
        """
        self.check_begun()
        found = self._player.active()
        marks: BoolArray = np.logical_or.reduce(found.reshape(self.num_envs, -1), axis=1)
        return marks

    @property
    def privileged_size(self) -> int:
        """How many numbers `privileged` has for each row."""
        with np.errstate(all="ignore"):  # nothing is drawn before the first reset, and only the size counts here
            return self.outside.privileged().size // self.num_envs

    def privileged(self) -> Observation:
        """What the episodes hide, (num_envs, p), for value functions in training only.

        Raises:
            ResetNeeded: before the first reset.
        """
        self.check_begun()
        shown = self.outside.privileged()
        return shown.reshape(self.num_envs, -1)

    def keep_past(self) -> None:
        """Keep what `past` tells, from the next reset of all episodes on: as many actions as an episode has decisions.

        Raises:
            ConfigurationError: this environment is for evaluations, or does not start ended episodes at once.
        """
        if self.evaluation or self.autoreset_mode != AutoresetMode.SAME_STEP:
            raise ConfigurationError('a past is kept of training with autoreset="same_step": make such an environment')
        vars(self).update(_past=Past(self.episodes))

    def past(self) -> dict[str, Array]:
        """How all episodes came where they are, as arrays by name that `resume` takes, for files.

        Raises:
            ResetNeeded: nothing has been kept: call `keep_past` before `reset`.
        """
        if self._past is None or not self._begun:
            raise ResetNeeded("no past has been kept: call keep_past(), then reset()")
        start = np.array(self._start, np.int64)
        return {"start": start, **self._past.arrays(), **{name: getattr(self, f"_{name}").copy() for name in TALLIES}}

    def resume(self, past: Arrays) -> Observation:
        """Play a `past` of an equal environment again, whose episodes then go on bit for bit; the rows (num_envs, n).

        It takes as long as the longest of the running episodes. `past` may come from a stranger.

        Raises:
            ValueError: these arrays are no past of such an environment.
        """
        self.keep_past()
        try:
            self._start = _number("start", past["start"].item())
            generators = seeded(self._seeds())
            start_again(past, generators)
            self._generators = generators
            self._begin(self._everyone)
            for actions, live in moves(past):
                if (live & (self.game.terminated | (self.game.elapsed >= self._limit))).any():
                    raise ValueError("an episode goes on after its end")
                self._advance(self._reader.batch(actions, self.num_envs), live)
            if (self.game.terminated | (self.game.elapsed >= self._limit)).any():
                raise ValueError("an episode has ended")
            for name in TALLIES:
                _put(past[name], getattr(self, f"_{name}"))
        except (KeyError, TypeError, ConfigurationError) as error:
            raise ValueError(f"it does not fit: {error}") from error
        self._costs.add(self.game.metrics())
        self._ended, self._any_ended = self._nobody, False
        return self._side.observe()

    def _advance(self, actions: Array, live: BoolArray) -> FloatArray:
        if self._past is not None:
            self._past.act(actions, live)
        payoff, rewards = self._side.step(actions, live, self._limit)
        if self._beside is not None:
            less = self._beside.step(live, self.frame_skip)
            rewards = rewards - (less if self.agents > 1 else less.sum(axis=1, keepdims=True)).reshape(-1)
        self._returns += SIGN[self.role] * payoff
        self._lengths += live
        return self._learned(rewards.reshape(self.episodes, self.agents)).reshape(-1)

    def _learned(self, reward: FloatArray) -> FloatArray:
        """What learners are paid, (B, A): the rewards, or the increase of a power of their sum so far."""
        power = self.training.pay_power
        if power == 1.0 or not is_own(self.config):
            return reward
        before = np.maximum(SIGN[self.role] * self._paid, 0.0)
        self._paid = self._paid + reward
        after = np.maximum(SIGN[self.role] * self._paid, 0.0)
        gained: FloatArray = SIGN[self.role] * ((1.0 + after) ** power - (1.0 + before) ** power)
        return gained

    def _final(self, metrics: dict[str, Array]) -> dict[str, Any]:
        final = super()._final(metrics)
        ended = self._ended
        whole = ended & ~self._cut
        episode = {"r": np.where(ended, self._returns, 0.0), "l": np.where(ended, self._lengths, 0)}
        final["final_info"] |= {"episode": {name: self._by_row(values) for name, values in episode.items()}}
        final["final_info"]["_episode"] = self._by_row(whole)
        return final

    def _restart(self, envs: BoolArray) -> None:
        begins_anew = self._next is not None
        super()._restart(envs)
        if begins_anew:
            self._stagger(self._staggered)

    def _seeds(self) -> list[int]:
        """The seeds (B,) of the episodes that begin next."""
        count = self.episodes // self.copies
        first, most = training_seed(self._run), SEEDS_PER_RUN
        if self.evaluation:
            first, most = validation_seed(self._run), SEEDS_PER_BLOCK
        places = ((self._start + self._played) * count + np.arange(self.episodes) % count) % most
        seeds: list[int] = (first + places).tolist()
        return seeds

    def _play(self, envs: BoolArray, drawn: Any) -> None:
        if self.evaluation:
            self._generators = reseeded(self._generators, self._seeds(), envs)
            self._played[envs] += 1
        if self._past is not None:
            self._past.begin(envs, cast(Lazy, self._generators))
        if self._beside is not None:
            self._beside.reset(envs, self._generators, drawn)
        super()._play(envs, drawn)
        self._clear(envs)

    def _clear(self, envs: BoolArray) -> None:
        self._paid[envs], self._returns[envs], self._lengths[envs], self._cut[envs] = 0.0, 0.0, 0, False

    def _stagger(self, wanted: bool) -> None:
        """Play at random until each episode has begun at a time of its own, if wanted and episodes are long enough."""
        if not wanted or self.decisions < FEWEST_STAGGERED:
            return
        generator = np.random.default_rng(training_seed(self._run) + self._start)
        begins = generator.integers(0, self.decisions, self.episodes)
        assert isinstance(self._side, LearningSide)
        for decision in range(self.decisions):
            self._advance(random_actions(self._side, generator), self._everyone)
            again = self.game.terminated | (self.game.elapsed >= self.game.horizon) | (begins == decision)
            if again.any():
                self._begin(again)
        played = self._lengths > 0
        self._clear(self._everyone)
        self._cut = played


def _number(name: str, value: Any) -> int:
    """A whole number from 0 on."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 0:
        raise ConfigurationError(f"{name} = {shown(value)} must be a whole number from 0 on")
    return int(value)


def _put(array: Array, place: Array) -> None:
    """Copy an array into another one of its shape and type, which holds finite numbers.

    Raises:
        ValueError: it has another shape or type, or numbers that are not finite.
    """
    if array.shape != place.shape or array.dtype != place.dtype or not np.isfinite(array).all():
        raise ValueError(f"an array has shape {array.shape} and type {array.dtype}, or is not finite")
    place[...] = array
