"""Recipes of `FdiAttack`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from agents.learning.recipe import Recipe


@dataclass(frozen=True)
class FdiAttack(Recipe):
    """One network for every attacked sensor and target, told by the observation."""

    name: str = "fdi-attack-ppo"
    problem: str = "fdi"
    overrides: Mapping[str, Any] = field(default_factory=lambda: {"attack_action": "share"})
    total_steps: int = 2_000_000
    num_lanes: int = 512
    steps_per_update: int = 20
    discount: float = 1.0
    hidden: tuple[int, ...] = (128, 128)
    entropy_bonus: float = 0.01
