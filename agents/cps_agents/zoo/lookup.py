"""Policies by source: `zoo:NAME`, `zoo:PATH` for trained policies, `sb3:FILE.zip` for stable-baselines3 models."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

from cps_agents.zoo.files import load
from cps_agents.zoo.wired import Head, WiredPolicy, wired_policy
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.errors import ConfigurationError, UnknownNameError, require
from cps_envs.core.learning.wiring import WiredBox, Wiring
from cps_envs.core.policies.lookup import check_spaces
from cps_envs.core.policies.policy import Policy, RoleSpec, takes_masks
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


def model(
    path: str | Policy,
    spec: RoleSpec,
    *,
    algorithm: str = "PPO",
    sampled: bool = False,
    vecnormalize: str | None = None,
    frame_stack: int = 1,
) -> Policy:
    """A stable-baselines3 model of your own; `algorithm` is the class that saved it, such as MaskablePPO.

    It plays its most likely action, or with `sampled` one that is drawn from the episode's own generator. A model that
    was trained in environments of `cps_agents.sb3.make` plays as it did there. One of the role's own spaces may have
    seen them through `VecNormalize`, whose file `vecnormalize` names ("" for none), and `VecFrameStack` of so many
    frames. Files are read with pickle, which can run any code. An object plays as its file does.

    Raises:
        UnknownNameError: there is no such file or algorithm.
        UntrustedCodeError: the user has not agreed to run what the file holds, see `cps_envs.trust`.
        MissingExtraError: stable-baselines3 is not installed.
        ValueError: the file is damaged, or a model of another algorithm.
        ConfigurationError: the model does not fit the role, or an option does not fit the model.
    """
    if not isinstance(path, str):
        return playable(path, spec)
    if not Path(path).is_file():
        raise UnknownNameError(f"there is no file {path!r}: write sb3:PATH, a model that stable-baselines3 saved")
    require_trust(f"sb3:{path}")
    found = _algorithm(algorithm)
    try:
        loaded: Policy = found.load(path, device="cpu")
    except Exception as error:  # whatever zipfile, pickle and torch raise
        raise ValueError(f"{path} is no {algorithm} model, or damaged: {error}") from error
    statistics = None
    if isinstance(getattr(loaded, "observation_space", None), WiredBox):
        if vecnormalize or frame_stack != 1:
            raise ConfigurationError(
                f"{path} was trained through the interface for learners, which scales its inputs itself: leave out "
                "vecnormalize and frame_stack"
            )
    elif vecnormalize is None:
        beside = sorted(Path(path).parent.glob("*vec*normalize*.pkl"))
        if beside:
            raise ConfigurationError(
                f"beside {path} lies {beside[0].name}: write sb3:{path}?vecnormalize={beside[0]} if the model has seen "
                "its inputs through it, or vecnormalize= if it has not"
            )
    elif vecnormalize:
        statistics = _statistics(vecnormalize)
    return playable(loaded, spec, sampled=sampled, statistics=statistics, frames=frame_stack)


def playable(
    policy: Policy, spec: RoleSpec, *, sampled: bool = False, statistics: Any = None, frames: int = 1
) -> Policy:
    """A policy for a role from an object that tells its spaces, such as a model of stable-baselines3.

    What was trained in the interface for learners plays through it; what has the role's own spaces may see them through
    a `VecNormalize` with `statistics` and as so many stacked `frames`. It plays its most likely action, or with
    `sampled` one that is drawn from the episode's generator. A recurrent one is handed its state, and `episode_start`
    where an episode begins. Other objects are returned as they are.

    Raises:
        ConfigurationError: the model does not fit the role, or has nothing to draw from.
    """
    space: Any = getattr(policy, "observation_space", None)
    wired = isinstance(space, WiredBox)
    if not hasattr(policy, "policy"):
        return WiredPolicy(spec, space.wiring, None, Head(sampled=sampled), policy) if wired else policy
    from cps_agents.sb3_models import draws, head_of, is_plain, layered, outputs_of_model

    kind = type(policy).__name__
    if sampled and not draws(policy):
        raise ConfigurationError(f"{kind} has no distribution of actions to draw from: leave out sampled=true")
    if wired and (is_plain(policy) or not (sampled or hasattr(policy.policy, "lstm_actor"))):
        return WiredPolicy(spec, space.wiring, outputs_of_model(policy), head_of(policy, sampled=sampled))
    if wired:
        return WiredPolicy(spec, space.wiring, None, Head(sampled=sampled), layered(policy, None, 1))
    if not isinstance(frames, int) or frames < 1:
        raise ConfigurationError(f"frame_stack = {frames} must be a whole number from 1 on")
    check_spaces(policy, f"this {kind}", spec, frames)
    inner = layered(policy, statistics, frames)
    wiring = Wiring(spec.problem, spec.role, NATIVE, masked=takes_masks(policy), plain=True)
    return WiredPolicy(spec, wiring, None, Head(sampled=sampled), inner)


def _statistics(path: str) -> Any:
    """A `VecNormalize` that its `save` has written."""
    if not Path(path).is_file():
        raise UnknownNameError(f"there is no file {path!r}: vecnormalize names what VecNormalize.save has written")
    require_trust(f"sb3:{path}")
    try:
        found = pickle.loads(Path(path).read_bytes())
    except Exception as error:  # whatever pickle raises
        raise ValueError(f"{path} is no file of VecNormalize, or damaged: {error}") from error
    if not hasattr(found, "normalize_obs"):
        raise ValueError(f"{path} holds no VecNormalize but {type(found).__name__}")
    return found


def _algorithm(name: str) -> Any:
    purpose = "playing a model of stable-baselines3"
    for package in ("stable_baselines3", "sb3_contrib"):
        module = require(package, extra="sb3", purpose=purpose)
        if hasattr(module, name):
            return getattr(module, name)
    raise UnknownNameError(f"neither stable-baselines3 nor sb3-contrib has an algorithm {name!r}")
