"""What made a policy: a network that learned, numbers that were searched, rules, or one that is told more."""

from __future__ import annotations

from dataclasses import dataclass

from cps_agents.errors import CommandError
from cps_agents.zoo.references import SB3, card_of
from cps_baselines.searched import searched_by
from cps_baselines.tracks import Track
from cps_envs.core.lookup import PolicyReference
from cps_envs.registration import find_problem

KINDS = {
    "reward": "network, by reward",
    "imitation": "network, by imitation",
    "searched": "searched numbers",
    "rules": "rules",
    "told": "told",
}


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
        return self.name in ("reward", "imitation")

    @property
    def ranked(self) -> bool:
        """Whether it knows no more than its role observes."""
        return self.name != "told"


def kind_of(track: Track, policy: PolicyReference) -> Kind:
    """The kind of a policy as far as its reference and card tell."""
    if not isinstance(policy, str) or policy.startswith(SB3):
        return Kind("reward")
    card = card_of(policy)
    if card is not None:
        return Kind("searched", len(card.numbers)) if card.numbers else Kind("reward")
    problem = find_problem(track.problem)
    if numbers := searched_by(problem.name, policy):
        return Kind("searched", len(numbers))
    built = problem.policy(policy, problem.game(track.venue.config, 1), track.role)
    return Kind("told" if getattr(built, "privileged", None) else "rules")
