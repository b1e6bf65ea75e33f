"""What happens between the integration steps: noise of actuators, radio, and what is noted of safety and ride."""

from __future__ import annotations

from cps_envs.core.compute.kernels import inlined
from cps_envs.core.compute.streams import uniform
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.drivers import watch_motion
from cps_envs.disbanding.dynamics import advance_episode, has_ended
from cps_envs.disbanding.radio import pass_on, wear_jam
from cps_envs.disbanding.ride import note_ride
from cps_envs.disbanding.safety import note_false_alarms, note_gaps
from cps_envs.disbanding.state import Constants, State


def is_eventful(config: DisbandingConfig) -> bool:
    """Whether anything happens between the integration steps under a configuration."""
    drawn = config.is_relayed or config.can_jam or config.correction_noise_mps2 > 0
    return drawn or config.watchful or config.report != "chapter"


@inlined
def advance_eventfully(
    episode: State, c: Constants, correction: FloatArray, closing: FloatArray, num_steps: int
) -> None:
    """`dynamics.advance_episode` with the events; every event has its multiples of integration steps."""
    for _ in range(num_steps):
        if has_ended(episode, c):
            return
        step = episode.step[0]
        if c.noise_width_mps2 > 0.0 and step % c.noise_steps == 0:
            renew_noise(episode, c)
        if step % c.period_steps == 0:
            note_gaps(episode, c)
            note_false_alarms(episode, c, correction)
            if episode.reaction_s.size > 0:
                watch_motion(episode, c)
        if c.ride_steps > 0 and step % c.ride_steps == 0:
            note_ride(episode, c)
        advance_episode(episode, c, correction, closing, 1)
        if c.relayed and episode.step[0] % c.hop_steps == 0:
            pass_on(episode, c)
        wear_jam(episode)


@inlined
def renew_noise(episode: State, c: Constants) -> None:
    """Draw what the actuator of each vehicle adds to its corrections from now on, uniform."""
    for q in range(c.num_vehicles):
        episode.noise_mps2[q] = c.noise_width_mps2 * (2.0 * uniform(episode.chance) - 1.0)
