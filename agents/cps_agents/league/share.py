"""How much of the best attack known a trained attacker reaches, against the opponent that it was trained for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from cps_agents.arena.challenge import contestants
from cps_agents.arena.statistics import Estimate, difference, estimate
from cps_agents.arena.store import Store
from cps_agents.errors import CommandError
from cps_agents.league.attacks import Trial, best, gather, paid
from cps_agents.league.response import Budget
from cps_agents.league.strategy import mix
from cps_agents.recipes.finding import RECIPES
from cps_agents.results.examination import find_blocks
from cps_agents.zoo.card import MIXTURE, Card
from cps_agents.zoo.references import FORMS
from cps_baselines.arena import Venue
from cps_envs.core.types import FloatArray
from cps_envs.registration import PROBLEMS, find_problem


@dataclass(frozen=True)
class Share:
    """What a card says of an attacker; a bound from above, since a longer search may find a better attack."""

    share: Estimate  # of the best attack's pay
    pay: Estimate  # what it is paid itself, on evaluation seeds
    best: dict[str, str]  # the best other attack against each opponent, as validation seeds choose
    best_pay: Estimate
    unit: str
    attacks: int  # known ones that played
    budget_s: float  # CPU time of all searches together
    training_seed: int  # of the attacker
    command: str

    def to_json(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


def share_of(card: Card, reference: str, budget: Budget, episodes: int, store: Store) -> Share:
    """Play an attacker and all other attacks against the opponents that it was trained for, in its configuration.

    Against each opponent the best attack counts, so the yardstick knows whom it meets. The teachers of recipes that are
    told the opponent play too, and the baselines of its results, what is possible at all among them.

    Raises:
        CommandError: it is no attacker, no attack fits, or none is paid anything.
    """
    if card.role != "attacker":
        raise CommandError(f"{card.name} is a defender: it is judged by the worst attack, not by a share of the best")
    form = FORMS.get((card.problem, card.role), ())  # its own way to see and act: others have theirs
    venue = Venue(card.problem, card.preset, {name: each for name, each in card.overrides.items() if name not in form})
    strategy = mix([opponent_of(card, reference)])
    trial = Trial(venue, strategy, episodes, budget, store, card.name)
    attacks = gather(trial, [*_teachers(card, strategy.policies), *_baselines(card, reference, episodes)])
    others = replace(attacks, known=[each for each in attacks.known if each.reference != reference])
    places = best(trial, others)
    weights = len(places) * np.array(strategy.probabilities)
    rivals = [
        paid(trial, [others.every[place]], [rival])[0, 0] for place, rival in zip(places, others.defenders, strict=True)
    ]
    mine = paid(trial, contestants(venue, [reference]), others.defenders)[0]
    own = [(weight * values)[None] for weight, values in zip(weights, mine, strict=True)]
    yardstick = [(weight * values)[None] for weight, values in zip(weights, rivals, strict=True)]
    return Share(
        share=_ratio(own, yardstick),
        pay=estimate(own),
        best={
            rival.reference: others.every[place].reference
            for rival, place in zip(others.defenders, places, strict=True)
        },
        best_pay=estimate(yardstick),
        unit=find_problem(card.problem).unit or "return",
        attacks=len(others.known),
        budget_s=0.0 if budget.cpu_s is None else budget.cpu_s,
        training_seed=card.best,
        command=budget.command,
    )


def opponent_of(card: Card, reference: str) -> str:
    """Whom an attacker was trained for; of a self-play's mixture, the mixture of the other role beside it."""
    return reference.replace("-attack-mixture", "-defense-mixture") if card.head == MIXTURE else card.opponent


def _teachers(card: Card, opponents: Sequence[str]) -> list[str]:
    """The teachers against these opponents that the recipes of the attacker's problem name."""
    recipes = [each for each in RECIPES.values() if (each.problem, each.role) == (card.problem, card.role)]
    found = [each.teachers[opponent] for each in recipes for opponent in opponents if opponent in each.teachers]
    return list(dict.fromkeys(found))


def _baselines(card: Card, reference: str, episodes: int) -> list[str]:
    """Those of the blocks that examine the attacker; not those that play fewer episodes, as they take too long."""
    blocks = find_blocks([card.problem]) if card.problem in PROBLEMS else []
    mine = [block for block in blocks if reference in {each.reference for each in block.learned}]
    return [
        each.reference
        for block in mine
        for each in block.baselines
        if not each.prepare and not 0 < each.episodes < episodes
    ]


def _ratio(own: Sequence[FloatArray], yardstick: Sequence[FloatArray]) -> Estimate:
    """The share with its interval, paired by episode: that of what is left of the pay beside the share of the best.

    Raises:
        CommandError: the best attack is paid nothing.
    """
    whole = estimate(yardstick).mean
    if whole <= 0:
        raise CommandError("no attack is paid anything against this opponent, so there is no share to tell")
    share = estimate(own).mean / whole
    left = difference(own, yardstick, share)
    low, high = (None if end is None else share + end / whole for end in (left.low, left.high))
    return replace(left, mean=share, low=low, high=high)
