"""What is measured: A_impact (4.19), and what tells how it came about."""

from __future__ import annotations

from cps_envs.core.kernels import inlined
from cps_envs.hvac.estimation import is_ready
from cps_envs.hvac.model import Model, Rules
from cps_envs.hvac.state import State


@inlined
def count_choice(model: Model, rules: Rules, episode: State) -> None:
    """Take note of the choice at k, once the window is full."""
    if not is_ready(rules, episode):
        return
    metrics, sets, a = episode.metrics[0], len(model.member), episode.choice[0] - 1
    if 0 <= a < sets:
        metrics.distinct_sets += not episode.used[a]
        episode.used[a] = True
        metrics.flawed_steps += is_flawed(model, episode, a) and episode.step[0] >= episode.onset[0]
    metrics.model_steps += a == sets
    passing = 0
    for other in range(sets):
        passing += episode.mean_residual[other] <= rules.threshold_c2
    metrics.rejecting_steps += passing == 0


@inlined
def is_flawed(model: Model, episode: State, a: int) -> bool:
    """Whether a set has a compromised sensor."""
    flawed = False
    for s in range(len(model.zone)):
        flawed |= model.member[a, s] and episode.compromised[s]
    return flawed


@inlined
def count_errors(model: Model, rules: Rules, episode: State) -> float:
    """Add the errors of x(k) to the sums; returns the attacker's payoff for them."""
    square = 0.0
    for i in range(len(episode.temperature)):
        error = episode.temperature[i] - rules.reference_c
        square += error * error
        episode.absolute_error[i] += abs(error)
    if episode.step[0] < episode.onset[0]:
        return 0.0
    episode.squared_error[0] += square
    return square / attacked_states(model, episode)


@inlined
def attacked_states(model: Model, episode: State) -> int:
    """T_a: number of states from the onset to the end."""
    return int(len(model.weather) - episode.onset[0])


@inlined
def measure(model: Model, episode: State) -> None:
    """Bring the metrics up to the state that are not counted step by step."""
    metrics, n, absolute = episode.metrics[0], len(episode.temperature), 0.0
    for i in range(n):
        absolute += episode.absolute_error[i]
    metrics.a_impact = episode.squared_error[0] / attacked_states(model, episode)
    metrics.mean_abs_error_c = absolute / (n * (episode.step[0] + 1))
    metrics.energy_kwh = episode.energy_j[0] / 3.6e6
