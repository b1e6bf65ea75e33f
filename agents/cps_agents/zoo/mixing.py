"""Mixed strategies as files: a card that names policies, with their probabilities in place of weights."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cps_agents.errors import CommandError
from cps_agents.zoo.card import MIXTURE, PARTS, SHIPPED, Card
from cps_agents.zoo.files import find, load, save
from cps_agents.zoo.fitting import check_role
from cps_agents.zoo.numbers import NamedNumbers, card_of_numbers
from cps_agents.zoo.references import PREFIX
from cps_baselines.arena import Venue
from cps_envs.core.policies.lookup import within_budget
from cps_envs.core.policies.mixture import Mixture
from cps_envs.core.policies.policy import Policy, RoleSpec
from cps_envs.core.types import Role, other


def mixed(spec: RoleSpec, card: Card, probabilities: NamedNumbers) -> Policy:
    """The policy of a card that is a mixed strategy.

    Raises:
        ConfigurationError: it is of another role or version, mixes mixtures, or names too many policies.
    """
    check_role(card, spec)
    with within_budget(card.name):
        return Mixture(spec, list(card.numbers), probabilities.values.tolist())


def save_mixture(
    target: Path,
    venue: Venue,
    role: Role,
    strategy: Mapping[str, float],
    facts: Mapping[str, Any],
    evaluation: Mapping[str, Any],
    command: str,
) -> Card:
    """Write a mixed strategy, the probabilities of references, as a trained policy; runs that it names come along.

    Raises:
        CommandError: one of its policies is a mixture itself.
    """
    references = [_kept(reference, target, place) for place, reference in enumerate(strategy, start=1)]
    card = card_of_numbers(
        venue,
        role,
        name=target.stem,
        algorithm="double-oracle",
        opponent=f"the {other(role)}s of the same self-play",
        recipe={},
        head=MIXTURE,
        best=0,
        seeds={"0": dict(facts)},
        command=command,
        evaluation=dict(evaluation),
        numbers=tuple(references),
    )
    return save(target, card, {0: NamedNumbers(np.array(list(strategy.values())))})


def _kept(reference: str, target: Path, place: int) -> str:
    """The reference of a policy that will be there: a run's own policy is copied beside the mixture."""
    name, _, options = reference.removeprefix(PREFIX).partition("?")
    if not reference.startswith(PREFIX) or find(name).parent in (SHIPPED, SHIPPED / PARTS):
        return reference
    card, network = load(find(name))
    if card.head == MIXTURE:
        raise CommandError(f"{reference} is a mixture itself: name its policies")
    own = target.parent / PARTS / f"{target.stem}-{place}.json"
    own.parent.mkdir(parents=True, exist_ok=True)
    kept = {**card.recipe, "opponent": "", "start": ""}  # the strategy that it answered names folders of this run
    save(
        own,
        replace(card, name=own.stem, opponent="a strategy of self-play", recipe=kept, command=""),
        {card.best: network},
    )
    shown = f"{PARTS}/{own.stem}" if own.parent.resolve() == (SHIPPED / PARTS).resolve() else str(own)
    return f"{PREFIX}{shown}{'?' if options else ''}{options}"
