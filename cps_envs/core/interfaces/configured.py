"""What an environment plays, and the one way to change it: `configure`."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from typing import Any

import gymnasium
from gymnasium.error import ResetNeeded

from cps_envs.core.declare.config import configure, is_drawn
from cps_envs.core.declare.training import Training
from cps_envs.core.errors import ConfigurationError, shown
from cps_envs.core.game.game import Game
from cps_envs.core.game.match import Match
from cps_envs.core.learning.setting import ARGUMENTS, Setting
from cps_envs.core.learning.side import LearningSide, Side
from cps_envs.core.learning.wiring import Scaling, WiredBox
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import other

SETTLED = frozenset({*ARGUMENTS, *(each.name for each in fields(Training))})  # by what an environment is made with
FREE = frozenset({"agents", "metadata", "render_mode", "spec", "observation_space", "action_space", "state_space"})
SIMILAR = 0.75  # of two names, from which on one is taken for the other, mistyped


@dataclass(frozen=True)
class Stage:
    """A role of a match, played from outside, and the fields of the configuration that it has been changed by."""

    setting: Setting
    opponent: PolicyReference | None
    match: Match
    side: Side
    changes: Mapping[str, Any]

    @property
    def game(self) -> Game:
        """That of the match."""
        return self.match.game

    @property
    def config(self) -> Any:
        """What the game is made for."""
        return self.setting.config

    @property
    def outward(self) -> tuple[Any, ...]:
        """What a learner was made for: it has to stay."""
        side, own = self.side, tuple(self.game.fields[self.setting.role])
        shown_by = tuple(side.outside.adapter.fields) if isinstance(side, LearningSide) else ()
        return side.observation_space, side.action_space, side.rows, own, shown_by


def stage_of(
    setting: Setting,
    opponent: PolicyReference,
    num_envs: int,
    *,
    joint: bool,
    flat: bool,
    scaling: Scaling | WiredBox | None,
    num_threads: int = 1,
) -> Stage:
    """The stage of a setting, before any change.

    Raises:
        ConfigurationError: a value that cannot be right.
        UnknownNameError: there is no such opponent or adapter.
    """
    match = setting.problem.match(setting.config, num_envs, {other(setting.role): opponent})
    match.game.use_threads(num_threads)
    return Stage(setting, opponent, match, setting.side(match, joint=joint, flat=flat, scaling=scaling), {})


def changed(stage: Stage, changes: Mapping[str, Any], opponent: PolicyReference, **form: Any) -> Stage:
    """A stage like this first one with some fields replaced, and the same scale of inputs; `form` as in `stage_of`."""
    first, side = stage.setting, stage.side
    config, overrides = configure(first.config, changes), {**first.overrides, **changes}
    kept = (side.wired.wiring.mean, side.wired.wiring.deviation) if isinstance(side, LearningSide) else None
    found = replace(first, config=config, overrides=overrides)
    made = stage_of(found, opponent, stage.game.num_envs, scaling=kept, **form)
    return replace(made, changes=dict(changes))


class Configured:
    """An environment whose configuration and opponent are read-only, but for `configure`."""

    config: Any  # what the episodes to come are drawn from
    opponent: PolicyReference | None
    game: Game
    _form: Mapping[str, Any]  # arguments of `stage_of`
    _first: Any  # stages: the one that the environment was made with, ...
    _stage: Any  # ... the one that plays, ...
    _next: Any = None  # ... and the one that takes its place at the next reset
    _changes: Mapping[str, Any] = {}  # fields that `configure` has named so far
    _drawn: Any = None  # the configuration that episodes draw from, if it is another one than the game's
    _once: Any = None  # the same for the reset that is being made
    _fixed: frozenset[str] = frozenset()
    _begun: bool = False  # whether there has been a reset

    def __setattr__(self, name: str, value: Any) -> None:
        if name in self._fixed:
            raise AttributeError(self._remedy(name, value))
        super().__setattr__(name, value)

    def configure(self, *, opponent: PolicyReference | None = None, **fields: Any) -> None:
        """Change fields of the configuration, or who plays the other role, from the next reset on: for a curriculum.

        `env.unwrapped.configure(power_ratio=2.5, opponent="sliding")`. What agents see and do stays as it is, with the
        same scale of inputs. Ranges of drawn quantities change as episodes start, one by one. For anything else a batch
        has to start anew as a whole: its next step truncates all episodes that are running, if it is not reset before.

        Raises:
            ConfigurationError: an unknown field, a value that cannot be right, or one with which agents would see or do
                something else: make another environment then.
            UnknownNameError: there is no such opponent.
            TypeError: the opponent is no policy.
        """
        newest = self._next or self._stage
        rival = newest.opponent if opponent is None else opponent
        changes = {**self._changes, **fields}
        whole = configure(self._first.config, changes)
        drawn_ones = {each.name for each in _fields(whole) if is_drawn(each)}
        built = {name: value for name, value in changes.items() if name not in drawn_ones}
        if not self._adopt(newest, changes, built, rival):
            self._adopt(newest, changes, changes, rival)
        vars(self).update(config=whole, opponent=rival, _changes=changes)

    def _adopt(
        self, newest: Any, changes: Mapping[str, Any], built: Mapping[str, Any], rival: PolicyReference | None
    ) -> bool:
        """Let a stage that is made for the changes `built` take over, and draw the others; whether it can draw them."""
        same = dict(newest.changes) == dict(built) and _same(newest.opponent, rival)
        stage = newest if same else self._build(built, rival)
        if stage.outward != self._first.outward:
            given = ", ".join(f"{name} = {shown(value)}" for name, value in built.items())
            raise ConfigurationError(
                f"with {given or 'this opponent'} agents would see or do something else, for which nobody has learned: "
                "make another environment"
            )
        rest, drawn = {name: value for name, value in changes.items() if name not in built}, None
        if rest:
            drawn = configure(stage.config, rest)
            try:
                stage.game.check_draws(drawn)
            except ConfigurationError:
                return False
        vars(self).update(_next=None if stage is self._stage else stage, _drawn=drawn)
        return True

    def _build(self, changes: Mapping[str, Any], rival: Any) -> Any:
        """The first stage with other fields and another opponent."""
        return changed(self._first, changes, rival, **self._form)

    def _use(self, stage: Any) -> None:
        """Play on this stage from now on."""
        raise NotImplementedError

    def _renew(self) -> None:
        """Let what `configure` has asked for take over; all episodes are to start."""
        if self._next is not None:
            stage = self._next
            vars(self).update(_next=None)
            self._use(stage)

    def _asked(self, options: Any, known: Collection[str] = ()) -> Any:
        """The configuration from which the reset with these options draws; None: the game's own.

        Options name quantities that episodes draw, such as `{"power_ratio": 2.5}`, and count for this reset only.
        `known` are options with another meaning.

        Raises:
            ValueError: they are no dictionary.
            ConfigurationError: they name what no episode draws, or a value that cannot be.
        """
        if options is not None and not isinstance(options, dict):
            raise ValueError(f"options = {shown(options)} must be a dictionary, such as {{'reset_mask': mask}}")
        named = {name: value for name, value in (options or {}).items() if name not in known}
        if not named:
            return self._drawn
        game = (self._next or self._stage).game
        declared = {each.name: each for each in _fields(game.config)}
        for name in named:
            if name in declared and is_drawn(declared[name]):
                continue
            if name in declared or name in SETTLED or name == "config":
                raise ConfigurationError(f"the option {name} of reset: {self._remedy(name, named[name])}")
            drawn_ones = [each for each in declared if is_drawn(declared[each])]
            close = get_close_matches(str(name), (*declared, *SETTLED, *known), n=1, cutoff=SIMILAR)
            text = f"the option {shown(name)} of reset is unknown, and changes nothing"
            if close:
                raise ConfigurationError(f"{text}. Did you mean {close[0]!r}?")
            gymnasium.logger.warn(f"{text}. Known: {', '.join((*known, *drawn_ones))}")
        asked = {name: value for name, value in named.items() if name in declared}
        if not asked:
            return self._drawn
        drawn = configure(self._drawn or game.config, asked)
        game.check_draws(drawn)
        return drawn

    def check_begun(self) -> None:
        """Raise ResetNeeded before the first reset, where there is no episode to tell of."""
        if not self._begun:
            raise ResetNeeded("no episode has begun: call reset() first")

    def _seal(self) -> None:
        """Let nobody set what the environment was made with."""
        names = {name for name in vars(self) if not name.startswith("_")} | {each.name for each in _fields(self.config)}
        vars(self)["_fixed"] = frozenset(names | SETTLED | {"config", "game", "opponent"}) - FREE

    def _remedy(self, name: str, value: Any) -> str:
        if name in {each.name for each in _fields(self.config)}:
            how = f"{name}={shown(value)}"
        elif name in ("opponent", "config"):
            how = {"opponent": "opponent=...", "config": "FIELD=value"}[name]
        else:
            return f"{name} is settled when an environment is made: make another one"
        return f"{name} changes by configure({how}) only, from the next reset on, or in another environment"


def _same(one: PolicyReference | None, another: PolicyReference | None) -> bool:
    """Whether two references name one policy; objects may compare in ways of their own."""
    return one is another or (isinstance(one, str) and isinstance(another, str) and one == another)


def _fields(config: Any) -> tuple[Any, ...]:
    """The quantities of a configuration."""
    return fields(config)
