"""stable-baselines3 and sb3-contrib."""

from __future__ import annotations

import gymnasium
from sb3_contrib import MaskablePPO
from stable_baselines3 import DQN, PPO, SAC
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import SubprocVecEnv
from trying import PLAIN, attempt, each

SPAWN = {"vec_env_cls": SubprocVecEnv, "vec_env_kwargs": {"start_method": "spawn"}}


def native() -> None:
    from cps_agents.sb3 import as_sb3

    envs = gymnasium.make_vec("cps_envs:cps_envs/RogueAttack-v0", num_envs=8, autoreset_mode="SameStep")
    PPO("MlpPolicy", as_sb3(envs), n_steps=16, batch_size=64).learn(256)


if __name__ == "__main__":
    attempt("`check_env` of all ids", each(lambda name: check_env(gymnasium.make(name), skip_render_check=True), PLAIN))
    attempt(
        "PPO, workers by spawn",
        lambda: PPO("MlpPolicy", make_vec_env("cps_envs:cps_envs/RogueDefense-v0", 2, **SPAWN), n_steps=32).learn(64),
    )
    attempt("SAC", lambda: SAC("MlpPolicy", "cps_envs:cps_envs/HvacAttack-v0", learning_starts=10).learn(30))
    for name in ("FdiDefenseDiscrete", "RogueDefenseDiscrete", "HvacDefense"):
        attempt(
            f"DQN on {name}",
            lambda name=name: DQN("MlpPolicy", f"cps_envs:cps_envs/{name}-v0", learning_starts=10).learn(30),
        )
    for name in ("DisbandingAttack", "FdiAttack", "FdiAttackDiscrete"):
        attempt(
            f"MaskablePPO on {name}",
            lambda name=name: MaskablePPO("MlpPolicy", gymnasium.make(f"cps_envs/{name}-v0"), n_steps=32).learn(64),
        )
    attempt("PPO on the native vector environment", native, adapter="`cps_agents.sb3.as_sb3`")
