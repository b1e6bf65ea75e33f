"""The building and its controller: heating by gains (4.18), by a plan (4.17) or on and off, and one step of (4.5)."""

from __future__ import annotations

from cps_envs.core.compute.kernels import clip, copy, inlined, nearest
from cps_envs.core.types import FloatArray
from cps_envs.hvac.model import Model, Rules
from cps_envs.hvac.planning import Desk, plan
from cps_envs.hvac.state import Scratch, State, on_the_spot


@inlined
def heat(model: Model, rules: Rules, episode: State, change: FloatArray, desk: Desk) -> None:
    """Set the heating of this step from xh(k), which the controller was fed, and dxh(k), both (n,) C.

    The integrator u_c is continuous and within the limits of the plant, [0, E]; only what is applied is rounded to a
    level (4.18). On levels the next step goes on from what was applied. Thermostats have no integrator; theirs is what
    they switched on. While the defender hands the heating to those on the spot, that of the controller waits.
    """
    if on_the_spot(rules, episode):
        switch(model, rules, episode, episode.heating)
        return
    if len(episode.plan) > 0:
        plan(model, rules, episode, change, desk)
        copy(episode.plan[0], episode.integrator)
    elif rules.switches:
        switch(model, rules, episode, episode.integrator)
    else:
        add_gains(model, rules, episode, change)
    for i in range(len(change)):
        level = nearest(episode.integrator[i] / model.level_w[i])
        episode.heating[i] = clip(model.level_w[i] * level, model.least_w[i], model.most_w[i])
    if rules.on_levels:
        copy(episode.heating, episode.integrator)


@inlined
def add_gains(model: Model, rules: Rules, episode: State, change: FloatArray) -> None:
    """The integrator u_c by the gains of the program without limits, and clamped to those of the plant."""
    now = episode.first[0] + episode.step[0]
    ahead = model.feedforward[now]
    for i in range(len(ahead)):
        du = -ahead[i]
        for j in range(len(ahead)):
            du += model.error_gain[i, j] * (model.reference[now, j] + episode.shift[j] - episode.fed[j])
            du -= model.difference_gain[i, j] * change[j]
        episode.integrator[i] = clip(episode.integrator[i] + du, model.least_w[i], model.most_w[i])


@inlined
def switch(model: Model, rules: Rules, episode: State, power: FloatArray) -> None:
    """A thermostat in each zone: all of the heating below the band, none above it, and in it `power` (n,) W as before.

    A plant that cools does so with all its power above the band; within it, it stops where it passes the set-point.
    """
    wanted = model.reference[episode.first[0] + episode.step[0]]
    for i in range(len(power)):
        error = episode.fed[i] - (wanted[i] + episode.shift[i])
        if error < -rules.hysteresis_c:
            power[i] = model.most_w[i]
        elif error > rules.hysteresis_c:
            power[i] = model.least_w[i]
        elif model.least_w[i] < 0.0 and power[i] * error > 0.0:
            power[i] = 0.0


@inlined
def move(model: Model, rules: Rules, episode: State, scratch: Scratch) -> None:
    """Go from k to k + 1: the plant (4.5) with what the model does not know, and the forced response."""
    k, warming, reached = episode.step[0], scratch.change, scratch.vector
    w = model.weather[episode.first[0] + k]
    for i in range(len(w)):
        warming[i] = episode.supplied[i] + episode.heat[i]
        if len(episode.heat_drift) > 0:
            warming[i] += episode.heat_drift[k, i]
        episode.energy_j[0] += abs(episode.supplied[i]) * rules.step_s
    drift(episode.plant, model, episode.temperature, warming, w, reached)
    if len(episode.outdoor_error) > 0:
        for i in range(len(w)):
            if model.outside[i]:
                reached[i] += model.G[i] * episode.outdoor_error[k]
    copy(reached, episode.temperature)
    drift(model.A, model, episode.forced, episode.heating, w, reached)
    copy(reached, episode.forced)
    episode.step[0] += 1


@inlined
def drift(A: FloatArray, model: Model, x: FloatArray, u: FloatArray, w: FloatArray, reached: FloatArray) -> None:
    """Fill `reached` (n,) with A x + B u + G w, with diagonal B and G."""
    for i in range(len(x)):
        total = model.B[i] * u[i] + model.G[i] * w[i]
        for j in range(len(x)):
            total += A[i, j] * x[j]
        reached[i] = total
