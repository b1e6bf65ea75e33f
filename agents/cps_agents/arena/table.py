"""A table as data: who meets whom where, and the number that is taken of each meeting.

Whatever judges declares one: `evaluate` and its bars, a league, a pool of self-play, the paper's benchmark.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from string import Formatter
from typing import TypeAlias

import numpy as np

from cps_agents.arena.admission import short_name
from cps_agents.arena.meeting import Meeting, Result
from cps_agents.arena.venue import Venue
from cps_agents.zoo.references import Origin, origin_of
from cps_envs.core.declare.config import form_fields
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.errors import UnknownNameError, near
from cps_envs.core.types import ROLES, FloatArray, Role
from cps_envs.registration import find_problem

RETURN = "return"  # what the attacker is paid
HAPPENED = ">0"  # after a metric's name: 100 in episodes in which it is above zero, 0 in others
NUMBERS = ("value", "lower", "median", "upper", "share")  # of a cell, beside the means of all metrics
Pair: TypeAlias = tuple[int, int]  # row and column


@dataclass(frozen=True)
class Table:
    """Attackers in rows meet defenders in columns, all on the same seeds.

    Where one role is judged, its trained policies play with every training seed, and it may have bars: policies to
    compare with. A contestant may set fields of the venue, so columns may also be other configurations.
    """

    venue: Venue
    attackers: Sequence[Contestant]
    defenders: Sequence[Contestant]
    episodes: int = 1  # of each pair, on seeds first_seed, first_seed + 1, ...
    metric: str = RETURN
    per: str = ""  # a metric of the same episodes that the number is compared with
    first_seed: int = 0
    judged: Role | None = None
    bars: Sequence[Contestant] = ()  # of the judged role
    name: str = ""  # short, for file names
    title: str = ""
    axis: str = "defender"  # what distinguishes the columns, such as "task"
    # Of a cell: `value`, its quartiles `lower`, `median`, `upper`, its `share` of `per`, means of all metrics by name.
    form: str = "{value:.2f}"
    legend: str = ""  # how to read a cell
    only_full: bool = False  # whether a benchmark leaves it to `--full`

    @property
    def seeds(self) -> range:
        """The episodes' seeds."""
        return range(self.first_seed, self.first_seed + self.episodes)

    def check_numbers(self) -> None:
        """Refuse what no episode has before anything is played.

        Raises:
            UnknownNameError: there is no such metric, or no such number that `form` shows.
        """
        called = f"table {self.name!r}" if self.name else self.venue.problem
        metrics = [RETURN, *find_problem(self.venue.problem).game(self.venue.config, 1).metrics()]
        for name in (self.metric, self.per, *(each.metric for each in self.attackers)):
            if name and name.removesuffix(HAPPENED) not in metrics:
                raise UnknownNameError(f"{called} has no metric {name!r}. {near(name, metrics)}")
        known = [*metrics, *NUMBERS]
        for _, shown, _, _ in Formatter().parse(self.form):
            if shown and shown not in known:
                raise UnknownNameError(f"{called}: `form` shows {shown!r}. {near(shown, known)}")

    @property
    def measured(self) -> str:
        """What the number of a meeting is, with its unit where that is known."""
        if self.per:
            return f"{self.metric} / {self.per}"
        unit = find_problem(self.venue.problem).unit_of(self.venue.config) if self.metric == RETURN else ""
        return f"{self.metric}, {unit}" if unit else self.metric

    def players(self, role: Role) -> Sequence[Contestant]:
        """The contestants of a role; at the end the bars that are not among them."""
        mine = self.attackers if role == "attacker" else self.defenders
        names = {each.name for each in mine}
        return mine if role != self.judged else (*mine, *(each for each in self.bars if each.name not in names))

    def with_players(self, role: Role, players: Sequence[Contestant]) -> Table:
        """The same table with others in a role."""
        return replace(self, attackers=players) if role == "attacker" else replace(self, defenders=players)

    @property
    def pairs(self) -> list[Pair]:
        """Everybody with everybody."""
        rows, columns = (range(len(self.players(role))) for role in ROLES)
        return [(row, column) for row in rows for column in columns]

    def pair(self, pair: Pair) -> dict[Role, Contestant]:
        """The names of the two that meet."""
        return {role: self.players(role)[place] for role, place in zip(ROLES, pair, strict=True)}

    def episodes_of(self, pair: Pair) -> int:
        """How many episodes they play: as many as one of them needs, or those of the table."""
        return next(filter(None, (each.episodes for each in self.pair(pair).values())), self.episodes)

    def label(self, pair: Pair) -> str:
        """Its name in progress bars."""
        attacker, defender = (short_name(each.name) for each in self.pair(pair).values())
        return f"{self.name} {attacker} {defender}" if self.name else f"{attacker} - {defender}"

    def meeting(self, pair: Pair) -> Meeting:
        """The one of contestants whose training seeds do not count."""
        players = self.pair(pair)
        return self._meeting(pair, {role: each.reference for role, each in players.items()})

    def meetings(self, pair: Pair) -> list[Meeting]:
        """One meeting, or one for each training seed of a policy that is judged."""
        names: dict[Role, str] = {role: each.reference for role, each in self.pair(pair).items()}
        if self.judged is None:
            return [self._meeting(pair, names)]
        judged, origin = self.judged, self.origin(names[self.judged])
        if len(origin.seeds) == 1 and (origin.card is not None or None in origin.seeds):
            return [self._meeting(pair, names)]  # the same meeting as with the seed's number
        return [
            self._meeting(pair, {**names, judged: reference}, f", seed {seed}")
            for seed, reference in origin.seeds.items()
        ]

    def _meeting(self, pair: Pair, names: Mapping[Role, str], seed: str = "") -> Meeting:
        """The meeting of these policies, in the observation and action forms that trained ones know."""
        players = self.pair(pair)
        origins = [self.origin(each.reference) for each in players.values()]
        own = {name: value for each in players.values() for name, value in each.overrides.items()}
        forms = form_fields(self.venue.config)
        config = self.venue.changed({name: value for name, value in own.items() if name not in forms}).config
        for each in origins:
            own |= each.form(config)
        return Meeting(
            venue=self.venue.changed(own),
            attacker=names["attacker"],
            defender=names["defender"],
            episodes=self.episodes_of(pair),
            first_seed=self.first_seed,
            sources={name: value for each in origins for name, value in each.sources.items()},
            label=f"{self.label(pair)}{seed}",
        )

    def origin(self, reference: str) -> Origin:
        """What lies behind a contestant's reference, looked up once."""
        if reference not in self._origins:
            self._origins[reference] = origin_of(self.venue.problem, reference)
        return self._origins[reference]

    @cached_property
    def _origins(self) -> dict[str, Origin]:
        return {}


def scores(results: Sequence[Result], metric: str, per: str = "") -> FloatArray:
    """A metric (training seeds, episodes), divided episode by episode by another one if `per` names it.

    The mean of "collided>0" is the percentage of episodes in which `collided` is above zero.

    Raises:
        UnknownNameError: the episodes have no such metric.
        ValueError: the divisor is 0 in some episode.
    """
    if metric.endswith(HAPPENED):
        return np.where(scores(results, metric.removesuffix(HAPPENED)) > 0, 100.0, 0.0)
    for name in (metric, *([per] if per else [])):
        if name not in results[0]["metrics"]:
            raise UnknownNameError(f"there is no metric {name!r}. {near(name, results[0]['metrics'])}")
    values = np.array([result["metrics"][metric] for result in results], np.float64)
    if not per:
        return values
    divisors = np.array([result["metrics"][per] for result in results], np.float64)
    if not divisors.all():
        raise ValueError(f"{per} is 0 in some episode: there is nothing to compare {metric} with")
    share: FloatArray = values / divisors
    return share
