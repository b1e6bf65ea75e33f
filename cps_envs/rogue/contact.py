"""What counts as damage: vehicles that pass through one another, or solid bodies (specification 5)."""

from __future__ import annotations

from cps_envs.core.compute.kernels import Record, inlined
from cps_envs.rogue.state import Rules, State, touching_m

REARM_M = 0.05  # beyond contact, from where on a further contact counts


@inlined
def touch(episode: State, i: int, score: Record, r: Rules) -> None:
    """Account for the contact of pair `i`."""
    gap = episode.position[i + 1] - episode.position[i] - touching_m(episode, i)
    if gap < 0.0:
        if r.solid:
            collide(episode, i, -gap, r.bumper_mps)
        else:
            episode.damage[i] += abs(episode.speed[i + 1] - episode.speed[i]) * r.dt_s
        if episode.armed[i]:
            episode.armed[i] = False
            episode.collisions[i] += 1
            if score.first_collision_s < 0.0:
                score.first_collision_s = (episode.step[0] + 1) * r.dt_s
    elif gap > REARM_M:
        episode.armed[i] = True


@inlined
def collide(episode: State, i: int, overlap_m: float, bumper_mps: float) -> None:
    """An inelastic collision of equal masses, whose bumpers take some of the speed.

    Pushing, and touching again before the pair is armed, adds no damage.
    """
    closing = episode.speed[i] - episode.speed[i + 1]
    if closing > 0.0:
        if episode.armed[i]:
            episode.damage[i] += max(0.0, closing - bumper_mps)
        episode.speed[i] = episode.speed[i + 1] = 0.5 * (episode.speed[i] + episode.speed[i + 1])
    episode.position[i] -= 0.5 * overlap_m
    episode.position[i + 1] += 0.5 * overlap_m
