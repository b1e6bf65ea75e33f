"""A problem as the interfaces see it: its presets, its game, who plays the other role by default, and its viewer."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cps_envs.core.declare.config import configure, parameter_table
from cps_envs.core.declare.foreign import other_fields, tell
from cps_envs.core.declare.objective import foreign_pay, is_own
from cps_envs.core.declare.training import Training
from cps_envs.core.errors import ConfigurationError, near, shown
from cps_envs.core.policies.lookup import PolicyReference, resolve_policy
from cps_envs.core.policies.policy import Policy, members_of
from cps_envs.core.policies.trust import vouched
from cps_envs.core.types import ROLES, Role

if TYPE_CHECKING:  # a declaration has to be cheap to import: what it names brings the compiler of kernels along
    from cps_envs.core.declare.fields import Fields
    from cps_envs.core.game.game import Game
    from cps_envs.core.game.match import Match


@dataclass(frozen=True)
class Later:
    """A function or class that is imported when it is first called: `Later("cps_envs.hvac.game:HvacGame")`."""

    path: str  # "module:attribute"

    def __call__(self, *arguments: Any) -> Any:
        """Call it."""
        return imported(self.path)(*arguments)


def imported(path: str) -> Any:
    """What a path "module:attribute" names."""
    module, _, attribute = path.partition(":")
    return getattr(importlib.import_module(module), attribute)


MOST_SHOWN = 60  # characters of a value in a sentence
LEARNING = "learning"  # the preset that learners meet, and everybody who names none


@dataclass(frozen=True)
class Work:
    """A unit of physics, in which the speed of a problem's simulation is measured."""

    unit: str  # plural, such as "vehicle-steps"
    per_game_step: Callable[[Any], float]  # units that an environment does in a game step under a configuration


@dataclass(frozen=True)
class Problem:
    """Everything that distinguishes one problem from another, for interfaces, registration and command line.

    Environments are pickled with their problem, so its parts are importable functions and classes, no lambdas. Those
    that need compiled kernels can be `Later`, so that listing problems does not load them.
    """

    name: str  # lower case, the package's name
    version: int  # a change that alters any number makes a new one
    summary: str  # one line
    presets: Mapping[str, Any]  # name -> frozen configuration
    game: Callable[[Any, int], Game]  # called as game(config, num_envs)
    fields: Mapping[Role, Callable[[Any], Fields]]  # what each role observes under a configuration
    opponents: Mapping[str, Mapping[Role, str]]  # preset -> who plays a role that nobody else plays
    viewer: str = ""  # "module:attribute", called as viewer(config), with a method frame(scene) -> uint8 (H, W, 3)
    swarm: Mapping[Role, str] = field(default_factory=dict)  # role -> the adapter by which it is a team of agents
    scaling: Path | None = None  # JSON with the scale of learners' inputs; None: measured by each process
    recorded: Mapping[str, tuple[str, str, str]] = field(default_factory=dict)  # of scenes: name, unit, meaning
    cost: str = ""  # the metric that counts what safe learners keep within `cost_limit`; its increase is `info["cost"]`
    cost_limit: float = 0.0  # of an episode
    namespace: str = "cps_envs"  # of the ids, and the package whose import registers them: one word, without dots
    unit: str = ""  # of what the attacker is paid by its game's own payoff, such as "m/s"
    units: Mapping[str, tuple[str, str]] = field(default_factory=dict)  # field -> a word of it, and the unit with that
    work: Work | None = None  # what `cps-envs bench` counts beside steps
    foreign: Callable[[Any], Sequence[str]] | None = None  # sentences on its numbers that fit another system only
    system: tuple[str, ...] = ()  # fields that decide whether numbers found for a preset fit
    training: Mapping[Role, Training] = field(default_factory=dict)  # of preset `learning`

    def __post_init__(self) -> None:
        for preset in self.presets:
            for role in ROLES:
                if role not in self.opponents.get(preset, ()):
                    raise ConfigurationError(f"opponents of {self.name} names no {role} of the preset {preset!r}")

    @property
    def usual_preset(self) -> str:
        """The preset if none is named: `learning`, or the first of a problem without it."""
        return LEARNING if LEARNING in self.presets else next(iter(self.presets))

    def config(self, preset: str | None, overrides: Mapping[str, Any]) -> Any:
        """The configuration of a preset, `usual_preset` where None is named, with some fields replaced.

        Raises:
            ConfigurationError: an unknown preset or field, or a value that cannot be right.
        """
        preset = self.usual_preset if preset is None else preset
        if not isinstance(preset, str) or preset not in self.presets:
            raise ConfigurationError(f"{self.name} has no preset {shown(preset)}. {near(shown(preset), self.presets)}")
        return configure(self.presets[preset], overrides)

    def opponent(self, preset: str | None, role: Role) -> str:
        """The default policy of a role in a preset."""
        return self.opponents[self.usual_preset if preset is None else preset][role]

    def unit_of(self, config: Any) -> str:
        """The unit of the attacker's return under a configuration; empty if none is known."""
        if not is_own(config):
            return ""
        found = [unit for name, (word, unit) in self.units.items() if getattr(config, name) == word]
        return found[0] if found else self.unit

    def foreign_to(self, config: Any) -> list[str]:
        """Sentences about numbers of a configuration that were found for another system than it describes."""
        found = [foreign_pay(self.name, config)] if foreign_pay(self.name, config) else []
        return [*found, *(self.foreign(config) if self.foreign is not None else ())]

    def match(self, config: Any, num_envs: int, players: Mapping[Role, PolicyReference]) -> Match:
        """A batch of episodes with some roles played from inside.

        Warns:
            ForeignSettingWarning: numbers of the configuration, or of a policy, were found for another system.
        """
        from cps_envs.core.game.match import Match

        tell(self.foreign_to(config))
        game = self.game(config, num_envs)
        return Match(game, {role: self.policy(reference, game, role) for role, reference in players.items()})

    def policy(self, reference: PolicyReference, game: Game, role: Role) -> Policy:
        """The policy that a reference names for a role of a game of this problem.

        Raises:
            UntrustedCodeError: it names code, the user has not agreed to run it, and it is none of `opponents`.
        """
        declared = isinstance(reference, str) and any(reference in usual.values() for usual in self.opponents.values())
        with vouched() if declared else nullcontext():
            found = resolve_policy(reference, game.spec(role))
        tell(dict.fromkeys(filter(None, (self._foreign_numbers(each, game.config) for each in members_of(found)))))
        return found

    def _foreign_numbers(self, policy: Any, config: Any) -> str:
        """A sentence on numbers that a policy brings along, if they were found for other systems than this."""
        origin: tuple[str, Mapping[str, Any]] | None = getattr(policy, "found_in", None)
        count = getattr(policy, "searched_numbers", 0)
        if origin is None and not count:
            return ""
        try:
            own = {} if origin is None else {"": self.config(*origin)}
        except ConfigurationError:  # of a network for a preset that is gone
            own = {}
        others = other_fields(config, {**self.presets, **own}, self.system)
        if not others:
            return ""
        value = shown(getattr(config, others[0]), MOST_SHOWN)
        what = (
            "a network was trained" if origin is not None else f"{count} numbers of {type(policy).__name__} were found"
        )
        return f"{what} for other systems than one with {others[0]} = {value}, and may play badly here: train anew"

    def env_id(self, role: Role) -> str:
        """Gymnasium's id of a role, such as `cps_envs/HvacAttack-v0`."""
        side = {"attacker": "Attack", "defender": "Defense"}[role]
        return f"{self.namespace}/{self.name.capitalize()}{side}-v{self.version}"

    def document(self, text: str, role: Role) -> str:
        """A docstring with the tables of the usual preset put in place of its placeholders."""
        usual = self.presets[self.usual_preset]
        tables = {"observation_table": self.fields[role](usual).table(), "parameter_table": parameter_table(usual)}
        for name, table in tables.items():
            text = text.replace(f"{{{name}}}", table)
        return text

    def make_viewer(self, config: Any) -> Any:
        """The viewer of this problem.

        Raises:
            ConfigurationError: it has none.
            MissingExtraError: the drawing package is not installed.
        """
        if not self.viewer:
            raise ConfigurationError(f"{self.name} is not drawn: its Problem names no viewer")
        return imported(self.viewer)(config)
