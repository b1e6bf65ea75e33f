"""Mixed strategies as references to policies: several policies, one drawn for each episode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cps_envs.core.declare.panel import mixture
from cps_envs.core.policies.lookup import parsed

DIGITS = 6  # of the weights in a reference


@dataclass(frozen=True)
class Strategy:
    """Policies with probabilities that add up to 1; a single one is a pure strategy.

    Raises:
        ValueError: no policies, as many weights as there are not, or weights that are no probabilities.
    """

    policies: tuple[str, ...]
    probabilities: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.policies or len(self.policies) != len(self.probabilities):
            raise ValueError(
                f"{len(self.policies)} policies with {len(self.probabilities)} weights: one weight for each"
            )
        if min(self.probabilities) < 0 or abs(sum(self.probabilities) - 1) > 1e-6:
            raise ValueError(f"{self.probabilities} are no probabilities")

    @property
    def reference(self) -> str:
        """What `play`, `train` and every other command take: the policy itself, or `mixture?policies=...`."""
        if len(self.policies) == 1:
            return self.policies[0]
        weights = [round(share, DIGITS) for share in self.probabilities]
        return mixture(self.policies, weights)


def mix(policies: Sequence[str], weights: Sequence[float] | None = None) -> Strategy:
    """A strategy of references, mixtures among them taken apart, with weights of any sum (equal if left out).

    What a reference would round to nothing is left out.

    Raises:
        ValueError: weights that do not fit the policies, are negative or all zero.
    """
    shares = [1.0] * len(policies) if weights is None else [float(weight) for weight in weights]
    if len(shares) != len(policies) or not policies:
        raise ValueError(f"{len(policies)} policies with {len(shares)} weights: give one weight for each policy")
    if not all(0 <= share < float("inf") for share in shares) or not sum(shares) > 0:
        raise ValueError(f"weights {shares} have to be numbers, none negative, some positive")
    found: dict[str, float] = {}
    for reference, share in zip(policies, shares, strict=True):
        for policy, part in _parts(reference):
            found[policy] = found.get(policy, 0.0) + part * share / sum(shares)
    kept = {policy: weight for policy, share in found.items() if (weight := round(share, DIGITS)) > 0}
    total = sum(kept.values())
    return Strategy(tuple(kept), tuple(weight / total for weight in kept.values()))


def _parts(reference: str) -> list[tuple[str, float]]:
    tree = parsed(reference)
    if not tree.is_mixture:
        return [(reference, 1.0)]
    try:
        inner = mix(_texts(tree.options.get("policies")), tree.options.get("weights"))
    except (ValueError, TypeError) as error:
        raise ValueError(
            f'{reference!r} is no mixture ({error}): write mixture?policies=["a","b"]&weights=[1,3]'
        ) from error
    return list(zip(inner.policies, inner.probabilities, strict=True))


def _texts(policies: object) -> list[str]:
    if not isinstance(policies, list) or not all(isinstance(each, str) for each in policies):
        raise TypeError(f"{policies!r} is no list of texts")
    return policies
