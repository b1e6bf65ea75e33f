"""What counts as damage: vehicles that pass through one another, or solid bodies (specification 5)."""

from __future__ import annotations

from cps_envs.rogue.kernel import Record, kernel

REARM_M = 0.05  # beyond contact, from where on a further contact counts


@kernel
def touch(behind: Record, ahead: Record, pair: Record, log: Record, r: Record) -> None:
    """Account for the contact of a pair after the motion of a step."""
    gap = ahead.position - behind.position - r.vehicle_length_m
    if gap < 0.0:
        if r.solid:
            collide(behind, ahead, pair, -gap)
        else:
            pair.damage += abs(ahead.speed - behind.speed) * r.dt_s
        if pair.armed:
            pair.armed = False
            pair.collisions += 1
            if log.first_collision_s < 0.0:
                log.first_collision_s = (log.step + 1) * r.dt_s
    elif gap > REARM_M:
        pair.armed = True


@kernel
def collide(behind: Record, ahead: Record, pair: Record, overlap_m: float) -> None:
    """An inelastic collision of equal masses; pushing, and touching again before the pair is armed, adds no damage."""
    closing = behind.speed - ahead.speed
    if closing > 0.0:
        if pair.armed:
            pair.damage += closing
        behind.speed = ahead.speed = 0.5 * (behind.speed + ahead.speed)
    behind.position -= 0.5 * overlap_m
    ahead.position += 0.5 * overlap_m
