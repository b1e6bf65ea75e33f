"""Policies by source: `zoo:NAME`, `zoo:PATH` for trained policies, `sb3:FILE.zip` for stable-baselines3 models."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cps_agents.zoo.files import load
from cps_agents.zoo.wired import Head, WiredPolicy, wired_policy
from cps_envs.core.errors import ConfigurationError, UnknownNameError, require
from cps_envs.core.learning.wiring import WiredBox
from cps_envs.core.policies.policy import Policy, RoleSpec
from cps_envs.core.policies.trust import require_trust


def trained(
    name: str, spec: RoleSpec, *, seed: int | None = None, deterministic: bool | None = None, untrained: bool = False
) -> Policy:
    """A shipped policy by its name, or one of your own by the path of its card or of its training run.

    `seed` chooses a training seed (`zoo:hvac-attack?seed=3`), the best by validation if left out. Without
    `deterministic` it plays as its card says, which for most is the most likely action. With `untrained` it plays the
    network that its training began with.

    Raises:
        UnknownNameError: there is no such policy.
        ValueError: a damaged file, a seed that is not in it, or no untrained network in it.
        ConfigurationError: the policy does not fit the role.
    """
    card, network = load(name, seed, untrained=untrained)
    sampled = None if deterministic is None else not deterministic
    policy = wired_policy(spec, card, network, sampled=sampled)
    policy.found_in = (card.preset, card.overrides)
    return policy


def model(path: str, spec: RoleSpec, *, algorithm: str = "PPO", sampled: bool = False) -> Policy:
    """A stable-baselines3 model of your own; `algorithm` is the class that saved it, such as MaskablePPO.

    A model that was trained in environments of `cps_agents.sb3.make` plays as it did there: by its most likely action,
    or with `sampled` by one that is drawn. The file is read with pickle, which can run any code.

    Raises:
        UnknownNameError: there is no such file or algorithm.
        UntrustedCodeError: the user has not agreed to run what the file holds, see `cps_envs.trust`.
        MissingExtraError: stable-baselines3 is not installed.
        ValueError: the file is damaged, or a model of another algorithm.
        ConfigurationError: the model does not fit the role, or `sampled` is for another kind of model.
    """
    if not Path(path).is_file():
        raise UnknownNameError(f"there is no file {path!r}: write sb3:PATH, a model that stable-baselines3 saved")
    require_trust(f"sb3:{path}")
    found = _algorithm(algorithm)
    try:
        loaded: Policy = found.load(path, device="cpu")
    except Exception as error:  # whatever zipfile, pickle and torch raise
        raise ValueError(f"{path} is no {algorithm} model, or damaged: {error}") from error
    if sampled and not isinstance(getattr(loaded, "observation_space", None), WiredBox):
        raise ConfigurationError(f"{path}: sampled=true is for models of cps_agents.sb3.make; leave it out")
    return playable(loaded, spec, sampled=sampled)


def playable(policy: Policy, spec: RoleSpec, *, sampled: bool = False) -> Policy:
    """A policy for a role from an object: what was trained in the interface for learners plays through it.

    That is a model of stable-baselines3, or any object with its `predict` and an `observation_space` from there. A
    recurrent one is handed its state, and `episode_start` where an episode begins.

    Raises:
        ConfigurationError: the model does not fit the role.
    """
    space = getattr(policy, "observation_space", None)
    if not isinstance(space, WiredBox):
        return policy
    if not hasattr(policy, "policy"):
        return WiredPolicy(spec, space.wiring, None, Head(sampled=sampled), policy)
    from cps_agents.sb3_models import RowsFirst, head_of, outputs_of_model

    if hasattr(policy.policy, "lstm_actor"):
        return WiredPolicy(spec, space.wiring, None, Head(sampled=sampled), RowsFirst(policy))
    return WiredPolicy(spec, space.wiring, outputs_of_model(policy), head_of(policy, sampled=sampled))


def _algorithm(name: str) -> Any:
    purpose = "playing a model of stable-baselines3"
    for package in ("stable_baselines3", "sb3_contrib"):
        module = require(package, extra="sb3", purpose=purpose)
        if hasattr(module, name):
            return getattr(module, name)
    raise UnknownNameError(f"neither stable-baselines3 nor sb3-contrib has an algorithm {name!r}")
