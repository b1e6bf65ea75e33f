"""What passengers feel and what driving costs, noted every 0.1 s of the vehicles that are intact then.

Energy is the traction at the wheels of a passenger car: mass times acceleration, rolling and air resistance, as long as
their sum pulls. Braking gives nothing back, and nobody saves air resistance by driving close behind another. All of its
numbers are chosen; the steady state at 31 m/s takes 522 kJ/km.
"""

from __future__ import annotations

from cps_envs.core.compute.kernels import inlined
from cps_envs.disbanding.controllers import has_begun
from cps_envs.disbanding.state import Constants, State

MASS_KG = 1500.0
ROLLING_N = 0.01 * MASS_KG * 9.81  # rolling resistance of 1 % of the weight
AIR_KG_PER_M = 0.5 * 1.2 * 0.65  # half the density of air in kg/m3 times the drag area in m2
RECOVERED = 0.1  # share of the desired speed within which a vehicle counts as undisturbed; chosen


@inlined
def traction_kw(speed: float, acceleration: float) -> float:
    """Power (kW) at the wheels of one vehicle; 0 where it brakes."""
    force = MASS_KG * acceleration + ROLLING_N + AIR_KG_PER_M * speed * speed
    return 1e-3 * speed * max(force, 0.0)


@inlined
def note_ride(episode: State, c: Constants) -> None:
    """Add the accelerations, jerks, work and distance of the intact vehicles, and note whether one is disturbed."""
    size, time_s, interval_s = c.vehicles_per_platoon, episode.step[0] * c.dt_s, c.ride_steps * c.dt_s
    band, disturbed, attacked = RECOVERED * c.desired_speed_mps, False, False
    squares, jerks, power_kw, speeds, noted = 0.0, 0.0, 0.0, 0.0, 0
    for platoon in range(c.num_vehicles // size):
        if has_begun(time_s, episode.disbanding_s[platoon]):
            attacked = True
        else:
            noted += size
            for q in range(platoon * size, (platoon + 1) * size):
                speed, acceleration = episode.speed[q], episode.acceleration[q]
                jerk = (acceleration - episode.noted_acceleration[q]) / interval_s
                squares += acceleration * acceleration
                jerks += jerk * jerk
                power_kw += traction_kw(speed, acceleration)
                speeds += speed
                disturbed = disturbed or abs(speed - c.desired_speed_mps) > band
                episode.noted_acceleration[q] = acceleration
    episode.noted[0] += noted
    episode.acceleration_squares[0] += squares
    episode.jerk_squares[0] += jerks
    episode.work_kj[0] += power_kw * interval_s
    episode.driven_km[0] += 1e-3 * speeds * interval_s
    if attacked and disturbed:
        episode.disturbed_s[0] = time_s
