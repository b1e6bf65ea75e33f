"""Whom the learned policies of a block are compared with: every registered policy of the role, and their teachers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from cps_agents.catalogue import policies
from cps_agents.recipes.finding import RECIPES
from cps_agents.results.block import Block
from cps_agents.zoo.references import card_of, is_missing
from cps_baselines.arena import Contestant
from cps_envs import find_problem
from cps_envs.core.lookup import NEED_OPTIONS


def completed(block: Block) -> Block:
    """The block with every registered policy of its role and every teacher of its learned policies as a baseline.

    Policies that know more than they observe play only where a block lists them.
    """
    return replace(block, baselines=(*block.baselines, *_registered(block), *_teachers(block)))


def _registered(block: Block) -> Iterator[Contestant]:
    listed = {each.reference.partition("?")[0] for each in block.baselines}
    for entry in policies(find_problem(block.problem), block.role):
        wanted = not entry.privileged and entry.name not in NEED_OPTIONS
        if wanted and entry.name not in listed and entry.name not in block.left_out:
            taken = entry.name in {each.name for each in block.contestants}
            yield Contestant(f"analytic {entry.name}" if taken else entry.name, entry.name)


def _teachers(block: Block) -> Iterator[Contestant]:
    listed = {each.reference for each in block.baselines}
    for each in block.learned:
        teacher = teacher_of(each)
        if teacher and teacher not in listed and teacher not in {found.reference for found in _registered(block)}:
            yield Contestant(f"teacher of {each.name}", teacher, f"teacher: {teacher}")


def teacher_of(learned: Contestant) -> str:
    """The reference of the policy that a shipped policy was first shown; empty if there was none."""
    card = None if is_missing(learned.reference) else card_of(learned.reference)
    recipe = RECIPES.get(card.name) if card is not None else None
    return recipe.teacher if recipe is not None else ""
