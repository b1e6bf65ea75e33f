"""What a picture of the platoon shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cps_envs.core.kernels import unpack
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.controllers import COMMANDED, DRIVEN
from cps_envs.rogue.state import NEVER, Drawn, State, platoon


@dataclass(frozen=True)
class Scene:
    """One episode at one time; n vehicles from the rear to the leader, pair i being vehicle i and the one ahead."""

    episode: int  # differs between the episodes of a game
    time_s: float
    duration_s: float
    attacker: int  # index of the seized vehicle, 0 = rear
    onset_s: float  # from when on the attacker drives; inf in an episode without an attack
    hidden: bool  # nothing marks the seized vehicle to the defender
    effort: float  # of the seized vehicle
    effort_limits: tuple[float, float]
    power_ratio: float
    position: FloatArray  # (n,) m, of the centres
    speed: FloatArray  # (n,) m/s
    acceleration: FloatArray  # (n,) m/s2
    reference_m: float  # where the leader ought to be
    reference_speed_mps: float
    separation_m: float  # sigma
    vehicle_length_m: float
    growth: FloatArray  # (n,) m, separation set-points minus sigma
    law: tuple[str, ...]  # (n,) that each vehicle drives by; "attacker" for the seized one
    alarm: IntArray  # (n,) 1: front neighbour detected, -1: rear one, 0: none
    detector: FloatArray  # (n, 2) m2/s3, z of the front and the rear side
    alarm_threshold: float  # m2/s3
    contact: str  # "pass" or "solid"
    touching: BoolArray  # (n - 1,) pairs in contact or in the wrong order, until they are apart again
    damage: FloatArray  # (n - 1,) so far, of each pair
    metrics: dict[str, float]

    @property
    def gap(self) -> FloatArray:
        """Distances (n - 1,) in m between the bumpers of each pair; below zero they overlap or are in wrong order."""
        return np.diff(self.position) - self.vehicle_length_m

    @property
    def blamed(self) -> list[int]:
        """The vehicles that an alarm points at: what the platoon believes."""
        raised = np.flatnonzero(self.alarm)
        return sorted(set((raised + self.alarm[raised]).tolist()))

    @property
    def desired_gap_m(self) -> float:
        """The gap that belongs to the separation sigma, m."""
        return self.separation_m - self.vehicle_length_m


def scene_of(state: State, drawn: Array, b: int, config: RogueConfig, metrics: dict[str, float]) -> Scene:
    """Copies of what a picture shows of an episode."""
    c = unpack(Drawn, drawn, b)
    episode = State._make(part.copy() for part in platoon(state, b, c.num_vehicles))
    names = ["commanded" if number == COMMANDED else DRIVEN[number] for number in episode.controller.tolist()]
    if not config.hidden or episode.step[0] > c.onset_step:
        names[c.attacker] = "attacker"
    return Scene(
        episode=c.noise_seed,
        time_s=float(episode.step[0] * config.dt_s),
        duration_s=config.duration_s,
        attacker=c.attacker,
        onset_s=c.onset_step * config.dt_s if c.onset_step < NEVER else np.inf,
        hidden=config.hidden,
        effort=float(episode.effort[c.attacker]),
        effort_limits=(config.min_effort, config.max_effort),
        power_ratio=c.attacker_drive_mps2 / c.drive_mps2,
        position=episode.position,
        speed=episode.speed,
        acceleration=episode.acceleration,
        reference_m=float(episode.position[-1]) + metrics["reference_error_m"],
        reference_speed_mps=c.reference_speed_mps,
        separation_m=config.separation_m,
        vehicle_length_m=config.vehicle_length_m,
        growth=episode.growth,
        law=tuple(names),
        alarm=episode.alarm,
        detector=np.stack([episode.front_detector, episode.rear_detector], axis=1),
        alarm_threshold=config.alarm_threshold,
        contact=config.contact,
        touching=~episode.armed,
        damage=episode.damage,
        metrics=metrics,
    )
