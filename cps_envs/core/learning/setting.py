"""What the arguments of an environment come to: configuration, opponent, and the interface that its learner meets."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any

from cps_envs.core.declare.config import check_count, plain
from cps_envs.core.declare.training import INTERFACE, NATIVE, Training
from cps_envs.core.errors import ConfigurationError, UnknownOptionError, shown
from cps_envs.core.game.configuration_file import ARGUMENT, with_file
from cps_envs.core.game.match import Match
from cps_envs.core.game.problem import LEARNING, Problem
from cps_envs.core.learning.outside import Outside
from cps_envs.core.learning.scaling import scaling_for
from cps_envs.core.learning.side import LearningSide, NativeSide, Side
from cps_envs.core.learning.wiring import Scaling, WiredBox, Wiring
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import Role, other

INTERFACES = (LEARNING, NATIVE)
ARGUMENTS = (
    "autoreset",
    ARGUMENT,
    "flat",
    "interface",
    "num_envs",
    "opponent",
    "per_agent",
    "preset",
    "render_mode",
    "scaling",
)
SHOWN_AS = frozenset({*INTERFACE, "shared_pay"})  # settings of `Training` that every form of a role takes
MANY_DECISIONS = 100  # of an episode, beyond which plain learners may not start at all


@dataclass(frozen=True)
class Setting:
    """A role of a problem as its outside meets it."""

    problem: Problem
    role: Role
    preset: str
    overrides: Mapping[str, Any]  # fields of the configuration that are not the preset's
    config: Any
    interface: str  # "learning" or "native"
    training: Training
    practised: Any = None  # the configuration that was trained in, and whose scale inputs have, if it is another one

    def wiring(self, match: Match, *, joint: bool, flat: bool, scaling: Scaling | WiredBox | None = None) -> Wiring:
        """The wiring that the settings ask for; `scaling` None: what ships, or is measured. A space brings its own.

        Raises:
            UnknownNameError: there is no such adapter.
            ConfigurationError: a setting makes no sense, or the adapter does not fit.
        """
        outside = Outside(match.game, self.role, self.training.adapter)
        plain = Wiring(
            self.problem.name,
            self.role,
            masked=outside.adapter.masked and match.game.action_mask(self.role) is not None,
            joint=joint and len(outside.agents) > 1,
            flat=flat,
            **{name: getattr(self.training, name) for name in INTERFACE},
        )
        alone = replace(plain, joint=False, flat=False)
        if scaling is None:
            mean, deviation = scaling_for(self.problem, self.practised or self.config, self.preset, alone)
        else:
            mean, deviation = _given(scaling)
        return replace(plain, mean=mean, deviation=deviation)

    def side(self, match: Match, *, joint: bool, flat: bool, scaling: Scaling | WiredBox | None = None) -> Side:
        """The role of a match, played from outside.

        Raises:
            UnknownNameError: there is no such adapter.
            ConfigurationError: a setting makes no sense, or the adapter does not fit.
        """
        if self.interface == NATIVE:
            return NativeSide(match, self.role, self.training.frame_skip, flat=flat)
        wiring = self.wiring(match, joint=joint, flat=flat, scaling=scaling)
        side = LearningSide(match, self.role, wiring, shared_pay=self.training.shared_pay)
        if (count := decisions_of(match, self.role, side.frame_skip)) > MANY_DECISIONS:
            warnings.warn(
                f"an episode has {count} decisions here; plain learners do best with 10 to 50: raise frame_skip = "
                f"{side.frame_skip}",
                stacklevel=4,
            )
        return side


def setting(
    problem: Problem,
    role: Role,
    preset: str | None,
    interface: str | None,
    options: Mapping[str, Any],
    training: Training | None = None,
    known: Collection[str] = SHOWN_AS,
) -> Setting:
    """Sort `options` into `known` settings of `training` and fields of the configuration.

    `interface` None is "learning" in the preset of that name, where the problem says how its role is learned, and
    "native" elsewhere. `training` None is the problem's. The option `config` names a configuration file; options beside
    it win over what it says.

    Raises:
        ConfigurationError: an unknown preset, field or interface, or a value that cannot be right.
    """
    preset, options = with_file(problem, preset, options)
    usual = problem.usual_preset if preset is None else preset
    own = {name: plain(name, value) for name, value in options.items() if name in known and value is not None}
    _check(own)
    overrides = {name: value for name, value in options.items() if name not in known}
    try:
        config = problem.config(usual, overrides)
    except UnknownOptionError as error:
        odd_name = next(name for name in overrides if not hasattr(problem.presets[usual], name))
        close = get_close_matches(odd_name, (*known, *ARGUMENTS), n=1)
        raise UnknownOptionError(f"{error} Or {close[0]!r}?" if close else str(error)) from None
    learned = usual == LEARNING and role in problem.training
    chosen = (LEARNING if learned or training is not None else NATIVE) if interface is None else interface
    if not isinstance(chosen, str) or chosen not in INTERFACES:
        raise ConfigurationError(f"interface = {shown(interface)} must be one of {', '.join(INTERFACES)}")
    base = training or (problem.training.get(role, Training()) if chosen == LEARNING else Training())
    odd = sorted(set(own) - {"frame_skip"})
    if chosen == NATIVE and odd:
        raise ConfigurationError(
            f"{odd[0]} is a setting of the interface for learners, and this environment has the native one: leave it "
            f'out, or say interface="{LEARNING}"'
        )
    return Setting(problem, role, usual, overrides, config, chosen, replace(base, **own))


def rival_of(found: Setting, opponent: PolicyReference | None) -> PolicyReference:
    """Who plays the other role: who is named, whom learners are to meet, or who plays it in the preset."""
    if opponent is not None:
        return opponent
    learned = found.training.opponent if found.interface == LEARNING and found.preset == LEARNING else ""
    return learned or found.problem.opponent(found.preset, other(found.role))


def decisions_of(match: Match, role: Role, frame_skip: int) -> int:
    """How often a role decides in an episode that the clock ends."""
    return -(-match.game.horizon // (match.game.decision_interval[role] * frame_skip))


def _given(scaling: Any) -> Scaling:
    """Mean and deviation as they are, or of an observation space.

    Raises:
        ConfigurationError: it is neither.
    """
    found = (scaling.wiring.mean, scaling.wiring.deviation) if isinstance(scaling, WiredBox) else scaling
    try:
        mean, deviation = (tuple(float(value) for value in each) for each in found)
    except (TypeError, ValueError):
        text = "must be mean and deviation of the inputs, or a model's observation_space of the interface for learners"
        raise ConfigurationError(f"scaling = {shown(scaling)} {text}") from None
    return mean, deviation


def _check(own: dict[str, Any]) -> None:
    """The kinds of settings; their values are the wiring's to judge.

    Raises:
        ConfigurationError: one that cannot be right.
    """
    if "frame_skip" in own:
        own["frame_skip"] = check_count("frame_skip", own["frame_skip"])
    for name, kind, wanted in (("adapter", str, "a name"), ("shared_pay", bool, "True or False")):
        if name in own and not isinstance(own[name], kind):
            raise ConfigurationError(f"{name} = {shown(own[name])} must be {wanted}")
