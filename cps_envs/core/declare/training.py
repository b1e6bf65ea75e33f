"""How an ordinary learner trains on a role: the settings that the role's page names, tried and measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

NATIVE = "native"  # the adapter that every role has, and the interface that is the game's own
INTERFACE = ("adapter", "frame_skip", "recent_s", "rough_s")  # settings that say what an agent sees and does


@dataclass(frozen=True)
class Training:
    """What a learner should play a role through, and how it should start. Everything can be set otherwise.

    `ppo` holds arguments of stable-baselines3's PPO; other libraries have the same under other names. With
    `final_learning_rate` the learning rate falls linearly to that over the steps of a run.
    """

    adapter: str = NATIVE  # name among the problem's `adapters` of the role
    opponent: str = ""  # whom a learner of preset learning meets; empty: who plays the other role there
    frame_skip: int = 1  # decisions of the role for which an agent holds its action
    recent_s: tuple[float, ...] = ()  # s, time constants of running averages of the observation, which are appended
    rough_s: float = 0.0  # s, time constant of a running average of the observation's changes; 0: none
    shared_pay: bool = False  # whether each agent of a team is paid what the whole team is, and not its own part
    pay_power: float = 1.0  # below 1 learners are paid the increase of (1 + what was paid so far) to this power
    relative: bool = False  # learners are paid what they gain over the neutral action in the same, second episode
    practised: Mapping[str, Any] = field(default_factory=dict)  # fields that training episodes of preset learning have
    sampled: bool = False  # whether a trained policy should draw its actions, as it does where rare events count
    num_envs: int = 64
    total_timesteps: int = 2_000_000  # rows for which the role's page trains: a few CPU minutes
    ppo: Mapping[str, Any] = field(default_factory=dict)
