"""More faulty versions of the toy problem: those that fail when they are pickled, made by id, or drawn."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from cps_envs.core.conformance import Subject
from cps_envs.core.interfaces.env import RoleEnv
from cps_envs.core.interfaces.vector_env import RoleVectorEnv
from tests.core.mutants import MUTANTS, SharesInfo, of
from tests.core.toy import ToyAttackEnv, ToyAttackVectorEnv, ToyDefenseVectorEnv, ToyViewer


class Unpicklable(ToyAttackEnv):
    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.hook = lambda: None


class LosesPlace(ToyAttackEnv):
    def __getstate__(self) -> Any:
        state = dict(vars(self))
        self.game.intruder[:] += 0.1
        return state


class LosesGenerator(ToyAttackEnv):
    def __getstate__(self) -> Any:
        return {name: value for name, value in vars(self).items() if name != "_np_random"}


for _name, _classes in {"pickling": (Unpicklable, LosesPlace), "pickled_generator": (LosesGenerator,)}.items():
    MUTANTS[f"check_{_name}"] = [
        lambda cls=cls: Subject(cls, ToyAttackVectorEnv, {"preset": "learning"}) for cls in _classes
    ]


class LosesPlaceInBatches(ToyAttackVectorEnv):
    def __getstate__(self) -> Any:
        state = dict(vars(self))
        self.game.intruder[:] += 0.1
        return state


MUTANTS["check_copies"] = [lambda: Subject(ToyAttackEnv, LosesPlaceInBatches, {"preset": "learning"})]


class CaresForTuples(ToyAttackEnv):
    def __init__(self, *, intruder_speed: Any = 0.5, **kwargs: Any) -> None:
        drift = 0.01 if isinstance(intruder_speed, tuple) else 0.1
        super().__init__(intruder_speed=intruder_speed, drift=drift, **kwargs)


def _registered(env_id: str, single: type[RoleEnv], vector: type[RoleVectorEnv], **kwargs: Any) -> Subject:
    if env_id not in gymnasium.registry:
        gymnasium.register(
            env_id,
            entry_point=f"{single.__module__}:{single.__name__}",
            vector_entry_point=f"{vector.__module__}:{vector.__name__}",
        )
    return Subject(single, vector, {"preset": "learning", **kwargs}, f"tests.core.toy:{env_id}")


MUTANTS["check_spec"] = [
    lambda: _registered("toys/Tuples-v0", CaresForTuples, ToyAttackVectorEnv, intruder_speed=(0.2, 0.4)),
    lambda: _registered("toys/OtherVector-v0", SharesInfo, ToyDefenseVectorEnv),
]
MUTANTS["check_subprocess"] = [lambda: _registered("toys/OnlyHere-v0", SharesInfo, ToyAttackVectorEnv)]


class OneFrame(ToyViewer):
    picture = np.zeros((32, 32, 3), np.uint8)

    def frame(self, scene: Any) -> Any:
        self.picture[:] = super().frame(scene)
        return self.picture


class FloatFrame(ToyViewer):
    def frame(self, scene: Any) -> Any:
        return super().frame(scene) / 255


MUTANTS["check_rendering"] = [
    lambda: of(viewer=f"{__name__}:OneFrame"),
    lambda: of(viewer=f"{__name__}:FloatFrame"),
]
