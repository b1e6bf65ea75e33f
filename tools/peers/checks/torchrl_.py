"""TorchRL's wrappers and its check of specifications."""

from __future__ import annotations

from importlib import import_module

from torchrl.envs import GymEnv, PettingZooWrapper
from torchrl.envs.utils import check_env_specs
from trying import DUELS, IDS, attempt, each

# TorchRL reads a MultiDiscrete of one entry as a number, which NumPy 2.4 refuses to convert: two attacked sensors.
OPTIONS = {"cps_envs/FdiAttack-v0": {"attacked": "xv4"}}


def duel(name: str) -> None:
    check_env_specs(PettingZooWrapper(import_module(f"cps_envs.{name}_v0").parallel_env(), use_mask=True))


if __name__ == "__main__":
    attempt("`GymEnv(id)` of all ids", each(lambda name: check_env_specs(GymEnv(name, **OPTIONS.get(name, {}))), IDS))
    attempt("`PettingZooWrapper` of all duels", each(duel, DUELS))
