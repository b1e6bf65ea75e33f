"""The toy problem with a declaration of how its roles are learned, whose holds do not fit into each other."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import gymnasium

from cps_envs.core.declare.training import Training
from cps_envs.core.interfaces.env import RoleEnv
from cps_envs.core.interfaces.vector_env import RoleVectorEnv
from cps_envs.core.types import ROLES, Role
from tests.core.toy import TOY, ToyConfig

SHORT: dict[str, Any] = {"duration_s": 15.0}  # ends in the middle of a held action of either role
LEARNED = replace(
    TOY,
    presets={"paper": ToyConfig(), "learning": ToyConfig(**SHORT, intruder_speed=(0.3, 0.9))},
    training={
        "attacker": Training(frame_skip=2, recent_s=(5.0,), rough_s=4.0),
        "defender": Training(adapter="axis", frame_skip=4, recent_s=(3.0, 6.0)),
    },
    namespace="learned_toys",
)


class LearnedAttackEnv(RoleEnv):
    """Reach the beacon."""

    problem, role = LEARNED, "attacker"


class LearnedDefenseEnv(RoleEnv):
    """Catch the intruder."""

    problem, role = LEARNED, "defender"


class LearnedAttackVectorEnv(RoleVectorEnv):
    problem, role = LEARNED, "attacker"


class LearnedDefenseVectorEnv(RoleVectorEnv):
    problem, role = LEARNED, "defender"


SINGLE: dict[Role, type[RoleEnv]] = {"attacker": LearnedAttackEnv, "defender": LearnedDefenseEnv}
BATCH: dict[Role, type[RoleVectorEnv]] = {"attacker": LearnedAttackVectorEnv, "defender": LearnedDefenseVectorEnv}
for _role in ROLES:
    if LEARNED.env_id(_role) not in gymnasium.registry:
        gymnasium.register(
            LEARNED.env_id(_role),
            entry_point=f"{__name__}:{SINGLE[_role].__name__}",
            vector_entry_point=f"{__name__}:{BATCH[_role].__name__}",
        )
