"""Every form of an environment as something that can be called: good and bad arguments, and what comes back."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

import cps_envs
from cps_envs.core.declare.training import Training
from cps_envs.core.errors import UnknownNameError
from cps_envs.core.interfaces.aec_env import RolesAECEnv
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv, RolesVectorEnv
from cps_envs.core.interfaces.swarm_env import SwarmEnv, SwarmVectorEnv
from tests.core.learned_toy import LEARNED, LearnedAttackEnv, LearnedDefenseEnv, LearnedDefenseVectorEnv
from tests.core.tank import TANK
from tests.core.toy import TOY, ToyAttackEnv, ToyAttackVectorEnv, ToyDefenseVectorEnv

DRAWN: dict[str, Any] = {"render_mode": "rgb_array"}
UNIT2, UNIT6 = ((0.0,) * 2, (1.0,) * 2), ((0.0,) * 6, (1.0,) * 6)
VALVE = Training(adapter="valve", frame_skip=3)


@dataclass(frozen=True)
class Form:
    """A way to make an environment; `good` and `bad` are what `configure` may and may not be asked for."""

    make: Callable[[], Any]
    good: tuple[Mapping[str, Any], ...]
    drawn: Mapping[str, Any]  # what reset may be asked for in options


def toy(make: Callable[[], Any]) -> Form:
    good = ({"drift": 0.2}, {"intruder_speed": 1.5}, {"intruder_speed": (0.4, 0.8), "catch_fee": 1.0})
    return Form(make, good, {"intruder_speed": 0.7})


def tank(make: Callable[[], Any]) -> Form:
    return Form(make, ({"leak": 0.1}, {"inflow": 0.3}, {"inflow": (0.2, 0.9)}), {"inflow": 0.25})


TOYS: dict[str, Form] = {
    "single": toy(lambda: ToyAttackEnv(**DRAWN)),
    "single, for learners": toy(lambda: LearnedAttackEnv(flat=True)),
    "single, a team": toy(lambda: LearnedDefenseEnv(scaling=UNIT6)),
    "made": toy(lambda: gymnasium.make("toys/ToyAttack-v0", disable_env_checker=True)),
    "vector": toy(lambda: ToyAttackVectorEnv(3, **DRAWN)),
    "vector, same step": toy(lambda: ToyDefenseVectorEnv(2, autoreset="same_step", max_episode_steps=5)),
    "vector, by hand": toy(lambda: ToyAttackVectorEnv(2, autoreset="disabled", frame_skip=2)),
    "vector, two threads": toy(lambda: ToyDefenseVectorEnv(4, num_threads=2)),
    "vector, rows": toy(lambda: LearnedDefenseVectorEnv(2, per_agent=True, scaling=UNIT6)),
    "training": toy(lambda: LearningVectorEnv(LEARNED, "defender", 3, scaling=UNIT6)),
    "training, relative": tank(
        lambda: LearningVectorEnv(
            TANK, "defender", 4, training=Training("pump"), relative=True, pay_power=0.5, copies=2, scaling=UNIT2
        )
    ),
    "training, one that waits": tank(lambda: LearningVectorEnv(TANK, "attacker", 3, training=VALVE, scaling=UNIT2)),
    "parallel": toy(lambda: RolesParallelEnv(LEARNED, **DRAWN)),
    "parallel, native": toy(lambda: RolesParallelEnv(TOY, max_cycles=7)),
    "parallel vector": toy(lambda: RolesVectorEnv(LEARNED, 2)),
    "parallel vector, by hand": toy(lambda: RolesVectorEnv(TOY, 2, autoreset="disabled")),
    "swarm": toy(lambda: SwarmEnv(TOY, "defender")),
    "swarm vector": toy(lambda: SwarmVectorEnv(LEARNED, "defender", 2, autoreset="next_step", max_cycles=3)),
    "turns": toy(lambda: RolesAECEnv(RolesParallelEnv(TOY))),
    "turns, for learners": toy(lambda: RolesAECEnv(RolesParallelEnv(LEARNED, **DRAWN))),
}

FIELDS: dict[str, tuple[tuple[Mapping[str, Any], ...], Mapping[str, Any]]] = {
    "disbanding": (({"collision_penalty": 2.0}, {"quiet_share": 0.1}), {"tau_s": 0.3}),
    "fdi": (({"attack_share": 1.0}, {"onset_s": (1.0, 2.0)}), {"onset_s": 2.0}),
    "hvac": (({"onset_step": 20}, {"onset_step": (10, 30)}), {"onset_step": 15}),
    "rogue": (({"power_ratio": 2.0}, {"power_ratio": (1.5, 2.5)}), {"power_ratio": 1.8}),
}


def _problem(name: str) -> dict[str, Form]:
    """The forms of one of the four problems."""
    good, drawn = FIELDS[name]
    side, pack = name.capitalize(), f"cps_envs.{name}_v0"
    makes: dict[str, Callable[[], Any]] = {}
    for role in ("Attack", "Defense"):
        makes[f"training, {role}"] = partial(cps_envs.learning_env, f"{side}{role}", 2)
        for interface in ("native", "learning"):
            given: dict[str, Any] = {"id": f"cps_envs/{side}{role}-v0", "interface": interface, **DRAWN}
            makes[f"{role}, {interface}"] = partial(gymnasium.make, **given, disable_env_checker=True)
            whole = {"num_envs": 2, "vectorization_mode": "vector_entry_point"}
            makes[f"{role}, {interface}, vector"] = partial(gymnasium.make_vec, **given, **whole)
    for interface in ("native", "learning"):
        makes[f"parallel, {interface}"] = partial(_called, pack, "parallel_env", interface=interface)
        makes[f"turns, {interface}"] = partial(_called, pack, "env", interface=interface)
    makes["parallel vector"] = partial(_called, pack, "parallel_env", num_envs=2)
    makes["swarm"] = partial(_called, pack, "swarm_env")
    makes["swarm vector"] = partial(_called, pack, "swarm_env", num_envs=2)
    return {f"{name}: {form}": Form(make, good, drawn) for form, make in makes.items()}


def _called(module: str, name: str, **given: Any) -> Any:
    return getattr(import_module(module), name)(**given)


def problems() -> dict[str, Form]:
    """The forms of all four problems."""
    return {key: form for name in FIELDS for key, form in _problem(name).items()}


def is_turns(env: Any) -> bool:
    return hasattr(env, "agent_iter")


def agents_of(env: Any) -> list[str] | None:
    found: list[str] | None = getattr(env, "possible_agents", None)
    return found


def count_of(env: Any) -> int | None:
    """Episodes of a batch; None of a single environment."""
    if isinstance(getattr(env, "num_envs", None), int):
        return int(getattr(env, "episodes", env.num_envs))
    return None


def drawn_from(space: spaces.Space[Any], draws: np.random.Generator) -> Any:
    if isinstance(space, spaces.Box):
        return draws.uniform(-1.2, 1.2, space.shape)
    if isinstance(space, spaces.Discrete):
        return int(draws.integers(space.n))
    return draws.integers(0, space.nvec)  # type: ignore[attr-defined]


def action(env: Any, draws: np.random.Generator) -> Any:
    """What `step` takes."""
    agents = agents_of(env)
    if is_turns(env):
        agent = getattr(env, "agent_selection", agents[0])  # type: ignore[index]
        over = getattr(env, "terminations", {}).get(agent) or getattr(env, "truncations", {}).get(agent)
        return None if over else drawn_from(env.action_space(agent), draws)
    if agents is None:
        return drawn_from(env.action_space, draws)
    count = count_of(env)
    if count is None:
        return {agent: drawn_from(env.action_space(agent), draws) for agent in agents}
    return {agent: np.stack([drawn_from(env.action_space(agent), draws) for _ in range(count)]) for agent in agents}


NO_ACTIONS: tuple[Any, ...] = (
    None,
    "up",
    b"up",
    [],
    {},
    object(),
    [[1], [2, 3]],
    np.nan,
    np.array(["a", "b"]),
    np.array([None, 1], object),
    np.array(1 + 2j),
    -1,
    10**9,
    10**40,
    np.zeros((7, 7, 7)),
    np.full(3, np.inf),
    True,
    np.datetime64("2026-01-01"),
)


def bad_action(env: Any, draws: np.random.Generator) -> Any:
    """What `step` should hardly take."""
    odd = NO_ACTIONS[int(draws.integers(len(NO_ACTIONS)))]
    agents = agents_of(env)
    kind = int(draws.integers(4))
    if agents is None or is_turns(env) or kind == 0:
        return odd
    whole = action(env, draws)
    if kind == 1:
        return {agent: whole[agent] for agent in agents[1:]}
    return {**whole, (agents[0] if kind == 2 else "nobody"): odd}


def seed(env: Any, draws: np.random.Generator) -> Any:
    number, count = int(draws.integers(1000)), count_of(env)
    choices: list[Any] = [None, number, np.int64(number)]
    if count is not None and not isinstance(env, LearningVectorEnv):
        choices += [[number + 7 * b for b in range(count)], [None] + [number] * (count - 1)]
    return choices[int(draws.integers(len(choices)))]


BAD_SEEDS: tuple[Any, ...] = (-1, 1.5, "one", True, [1.5], [1] * 9, object(), {}, np.nan, b"1", [None, "a"], [-1] * 2)


def options(env: Any, form: Form, draws: np.random.Generator) -> Any:
    choices: list[Any] = [None, None, {}, dict(form.drawn)]
    if (count := count_of(env)) is not None:
        choices += [{"reset_mask": draws.random(count) < 0.6}, {"reset_mask": np.ones(count, np.bool_), **form.drawn}]
    if isinstance(env, LearningVectorEnv):
        choices += [{"start": int(draws.integers(5))}, {"staggered": bool(draws.integers(2))}]
    return choices[int(draws.integers(len(choices)))]


BAD_OPTIONS: tuple[Any, ...] = (
    [1],
    "seed",
    3,
    {"reset_mask": [True]},
    {"reset_mask": np.ones(9, np.bool_)},
    {"reset_mask": "all"},
    {"frame_skip": 2},
    {"opponent": "none"},
    {"start": "x"},
    {"start": -1},
    {"staggered": "no"},
    {"intruder_speed": None, "power_ratio": "fast", "onset_s": [], "onset_step": -5, "tau_s": {}, "inflow": "x"},
    {"duration_s": 1.0},
)
BAD_CHANGES: tuple[Mapping[str, Any], ...] = (
    {"nothing_like_it": 1},
    {"opponent": "nobody_at_all"},
    {"opponent": 3},
    {"opponent": "mixture?policies=[3]"},
    {"duration_s": "long", "num_steps": "many", "horizon": "far"},
    {"drift": -1.0},
    {"frame_skip": 3},
    {"drift": object()},
    {"config": {}},
    {"payoff": {"nothing": 1.0}},
)
ASKED = ("action_masks", "active", "privileged", "state", "last", "render", "observe", "close")


def asked(env: Any, name: str) -> Any:
    """The answer to a question that changes nothing; None where nobody can ask it."""
    if not hasattr(env, name):
        return None
    return getattr(env, name)(agents_of(env)[0]) if name == "observe" else getattr(env, name)()  # type: ignore[index]


SET: tuple[tuple[str, Any], ...] = (("config", None), ("opponent", "none"), ("game", 3), ("preset", "paper"))


def digest(value: Any) -> str:
    """A text that is equal for equal results."""
    found = hashlib.sha256()
    _feed(found, value)
    return found.hexdigest()[:16]


def _feed(found: Any, value: Any) -> None:
    if isinstance(value, Mapping):
        for name in sorted(value, key=str):
            found.update(repr(name).encode())
            _feed(found, value[name])
    elif isinstance(value, (tuple, list)):
        found.update(f"{len(value)}".encode())
        for each in value:
            _feed(found, each)
    elif isinstance(value, np.ndarray) and value.dtype != object:
        found.update(f"{value.shape}{value.dtype}".encode() + np.ascontiguousarray(value).tobytes())
    elif isinstance(value, np.ndarray):
        _feed(found, list(value))
    else:
        found.update(repr(value).encode())


def told(env: Any, result: Any) -> str:
    """The digest of a step or reset, which of an environment of turns tells nothing by itself."""
    if not is_turns(env):
        return digest(result)
    known = (env.rewards, env.terminations, env.truncations, env.infos, env.agents, env.agent_selection)
    return digest((known, env.observe(env.agent_selection)) if env.agents else known)


def check_clear(error: BaseException, what: str) -> None:
    """Check that an error is a declared one, with a sentence, raised by us or one of Gymnasium's own."""
    kinds = (ValueError, gymnasium.error.Error, UnknownNameError, AttributeError, TypeError)
    trace, last = error.__traceback__, ""
    while trace is not None:
        last, trace = trace.tb_frame.f_code.co_filename, trace.tb_next
    ours = isinstance(error, gymnasium.error.Error) or "cps_envs" in last.replace("\\", "/").split("/")
    clear = isinstance(error, kinds) and ours and len(str(error).split()) >= 4
    assert clear, f"{what}: {type(error).__name__} in {last}: {error}"
