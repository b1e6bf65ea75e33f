"""What a picture of the platoon shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cps_envs.core.compute.kernels import unpack
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.controllers import COMMANDED, DRIVEN
from cps_envs.rogue.state import NEVER, Drawn, State, platoon


@dataclass(frozen=True)
class Scene:
    """One episode at one time; n vehicles from the rear to the leader, pair i being vehicle i and the one ahead."""

    config: RogueConfig
    episode: int  # differs between the episodes of a game
    time_s: float
    attacker: int  # index of the seized vehicle, 0 = rear; of several the rearmost
    rogue: BoolArray  # (n,) the seized vehicles
    onset_s: float  # from when on the attacker drives; inf in an episode without an attack
    effort: float  # of that vehicle
    power_ratio: float
    length: FloatArray  # (n,) m, of the vehicles
    position: FloatArray  # (n,) m, of the centres
    speed: FloatArray  # (n,) m/s
    acceleration: FloatArray  # (n,) m/s2
    reference_m: float  # where the leader ought to be
    reference_speed_mps: float
    growth: FloatArray  # (n,) m, separation set-points minus sigma, the `separation_m` of the configuration
    law: tuple[str, ...]  # (n,) that each vehicle drives by; "attacker" for a seized one
    alarm: IntArray  # (n,) 1: front neighbour detected, -1: rear one, 0: none
    detector: FloatArray  # (n, 2) m2/s3, z of the front and the rear side
    touching: BoolArray  # (n - 1,) pairs in contact or in the wrong order, until they are apart again
    damage: FloatArray  # (n - 1,) so far, of each pair
    metrics: dict[str, float]

    @property
    def gap(self) -> FloatArray:
        """Distances (n - 1,) in m between the bumpers of each pair; below zero they overlap or are in wrong order."""
        gap: FloatArray = np.diff(self.position) - 0.5 * (self.length[1:] + self.length[:-1])
        return gap

    @property
    def seized(self) -> list[int]:
        """The seized vehicles, 0 = rear."""
        seats: list[int] = np.flatnonzero(self.rogue).tolist()
        return seats

    @property
    def blamed(self) -> list[int]:
        """The vehicles that an alarm points at: what the platoon believes."""
        raised = np.flatnonzero(self.alarm)
        return sorted(set((raised + self.alarm[raised]).tolist()))

    @property
    def desired_gap_m(self) -> float:
        """The gap that belongs to the separation sigma, m; where vehicles differ, the smallest."""
        return float(self.config.separation_m - 0.5 * (self.length[1:] + self.length[:-1]).max())


def scene_of(state: State, drawn: Array, b: int, config: RogueConfig, metrics: dict[str, float]) -> Scene:
    """Copies of what a picture shows of an episode."""
    c = unpack(Drawn, drawn, b)
    episode = State._make(part.copy() for part in platoon(state, b, c.num_vehicles))
    names = ["commanded" if number == COMMANDED else DRIVEN[number] for number in episode.controller.tolist()]
    if not config.hidden or episode.step[0] > c.onset_step:
        names = ["attacker" if seized else name for name, seized in zip(names, episode.rogue.tolist(), strict=True)]
    return Scene(
        config=config,
        episode=c.noise_seed,
        time_s=float(episode.step[0] * config.dt_s),
        attacker=c.attacker,
        rogue=episode.rogue,
        onset_s=c.onset_step * config.dt_s if c.onset_step < NEVER else np.inf,
        effort=float(episode.effort[c.attacker]),
        power_ratio=c.attacker_drive_mps2 / c.drive_mps2,
        length=np.broadcast_to(episode.length_m, episode.position.shape),
        position=episode.position,
        speed=episode.speed,
        acceleration=episode.acceleration,
        reference_m=float(episode.position[-1]) + metrics["reference_error_m"],
        reference_speed_mps=c.reference_speed_mps,
        growth=episode.growth,
        law=tuple(names),
        alarm=episode.alarm,
        detector=np.stack([episode.front_detector, episode.rear_detector], axis=1),
        touching=~episode.armed,
        damage=episode.damage,
        metrics=metrics,
    )
