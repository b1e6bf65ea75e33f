"""What made a policy: a network that learned, numbers that were searched, rules, or one that is told more."""

from __future__ import annotations

from dataclasses import dataclass

from cps_agents.errors import CommandError
from cps_agents.scoring.tracks import Track
from cps_agents.zoo.card import read_card
from cps_agents.zoo.files import find
from cps_agents.zoo.references import SB3, ZOO
from cps_envs.core.policies.lookup import PolicyReference, parsed
from cps_envs.core.policies.reference import Reference
from cps_envs.registration import find_problem

KINDS = {
    "reward": "network, by reward",
    "imitation": "network, by imitation",
    "untrained": "network, untrained",
    "searched": "searched numbers",
    "rules": "rules",
    "told": "told",
}
UNTRAINED = "untrained"  # one of them, an algorithm of cards, and an option of `zoo:NAME`


@dataclass(frozen=True)
class Kind:
    """What an entry of a board is, one of `KINDS`; of searched numbers also how many."""

    name: str
    numbers: int = 0

    def __post_init__(self) -> None:
        if self.name not in KINDS:
            raise CommandError(f"there is no kind {self.name!r}: choose one of {', '.join(KINDS)}")
        if (self.name == "searched") != (self.numbers > 0):
            raise CommandError("say how many numbers were searched with `--numbers`, and only of kind `searched`")

    def __str__(self) -> str:
        return f"{self.numbers} {KINDS[self.name]}" if self.numbers else KINDS[self.name]

    @property
    def network(self) -> bool:
        """Whether training seeds count."""
        return self.name in ("reward", "imitation", UNTRAINED)

    @property
    def ranked(self) -> bool:
        """Whether it knows no more than its role observes."""
        return self.name != "told"


def kind_of(track: Track, policy: PolicyReference) -> Kind:
    """The kind of a policy as far as its reference and card tell."""
    if not isinstance(policy, str):
        return Kind("reward")
    networks = [each for each in parsed(policy).walk() if each.source in (ZOO, SB3)]
    if networks:
        return Kind(UNTRAINED if all(map(_is_untrained, networks)) else "reward")
    problem = find_problem(track.problem)
    built = problem.policy(policy, problem.game(track.venue.config, 1), track.role)
    if getattr(built, "privileged", None):
        return Kind("told")
    numbers = getattr(built, "searched_numbers", 0)
    return Kind("searched", numbers) if numbers else Kind("rules")


def _is_untrained(network: Reference) -> bool:
    if network.source == SB3:
        return False
    return bool(network.options.get(UNTRAINED)) or read_card(find(network.name)).algorithm == UNTRAINED
