"""Who plays preset `learning` beside the registered policies, by problem and role: what tools judge with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module

from cps_baselines.arena import Contestant
from cps_envs.core.types import Role


@dataclass(frozen=True)
class Rivals:
    """The policies that stand for one role in preset `learning`, and what they are told."""

    policies: tuple[Contestant, ...] = ()  # that see no more than the role does; `none`, the neutral one, included
    constants: tuple[str, ...] = ()  # policies that take one action, all or a grid of them, such as "always?action=1"
    informed: tuple[Contestant, ...] = ()  # told what the role has to infer


def declared(problem: str, role: Role) -> Rivals:
    """The rivals of a role, which `tools/rivals/<problem>.py` declares as `RIVALS`."""
    rivals: Mapping[Role, Rivals] = import_module(f"tools.rivals.{problem}").RIVALS
    return rivals[role]
