"""Learners, trained policies, and the means to judge them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cps_agents.scoring.score import Score


def score(track: str, policy: Any, **options: Any) -> Score:
    """A policy's score in a track such as "rogue-attack"; `policy` is a reference, or any object with `predict`.

    `options` are those of `cps_agents.scoring.score.score`, such as `split="dev"` for a quick look.
    """
    from cps_agents.scoring.score import score as scored

    return scored(track, policy, **options)
