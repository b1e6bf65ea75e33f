"""What is measured: A_impact (4.19), which is paid, discomfort and heating, and what tells how it came about."""

from __future__ import annotations

from cps_envs.core.compute.kernels import inlined
from cps_envs.hvac.estimation import is_ready
from cps_envs.hvac.model import Model, Rules
from cps_envs.hvac.state import State, on_the_spot


@inlined
def count_choice(model: Model, rules: Rules, episode: State) -> None:
    """Take note of the choice at k, once the window is full."""
    if not is_ready(rules, episode):
        return
    metrics, sets = episode.metrics[0], len(episode.residual)
    choice = 0 if on_the_spot(rules, episode) else episode.choice[0]
    by_model = sets + 1
    believed, flawed = 0, False
    for s in range(len(episode.measured)):
        if 0 < choice < by_model:
            uses = model.member[choice - 1, s]
        else:
            uses = choice > by_model and model.filter_member[choice - by_model - 1, s]
        believed += uses
        flawed |= uses and episode.compromised[s]
    if believed > 0:
        metrics.distinct_sets += not episode.used[choice]
        episode.used[choice] = True
        metrics.flawed_steps += flawed and episode.step[0] >= episode.onset[0]
    metrics.model_steps += believed == 0 and choice > 0
    passing = 0
    for other in range(sets):
        passing += episode.mean_residual[other] <= rules.threshold_c2
    metrics.rejecting_steps += passing == 0


@inlined
def count_errors(model: Model, rules: Rules, episode: State) -> float:
    """Add the errors of x(k), and the heating since k - 1, to the sums; returns the attacker's payoff for them."""
    square, outside, wanted = 0.0, 0, model.reference[episode.first[0] + episode.step[0]]
    for i in range(len(episode.temperature)):
        error = episode.temperature[i] - wanted[i]
        square += error * error
        outside += abs(error) > rules.comfort_c
        episode.absolute_error[i] += abs(error)
    if episode.step[0] < episode.onset[0]:
        return 0.0
    metrics, hours, kwh = episode.metrics[0], outside * rules.step_s / 3600.0, 0.0
    for i in range(len(episode.temperature)):
        error = episode.temperature[i] - wanted[i]
        episode.squared_by_zone[i] += error * error
        if episode.step[0] > episode.onset[0]:
            kwh += abs(episode.supplied[i]) * rules.step_s / 3.6e6
    episode.squared_error[0] += square
    metrics.discomfort_h += hours
    metrics.attack_kwh += kwh
    return float(square / attacked_states(rules, episode))


@inlined
def paid_at_start(rules: Rules, episode: State) -> float:
    """The attacker's payoff for x(0), which an attack from there on counts."""
    return float(episode.squared_error[0] / attacked_states(rules, episode))


@inlined
def attacked_states(rules: Rules, episode: State) -> int:
    """T_a: number of states from the onset to the end."""
    return int(rules.num_steps - episode.onset[0])


@inlined
def measure(rules: Rules, episode: State) -> None:
    """Bring the metrics up to the state that are not counted step by step."""
    metrics, n, absolute = episode.metrics[0], len(episode.temperature), 0.0
    for i in range(n):
        absolute += episode.absolute_error[i]
    metrics.a_impact = episode.squared_error[0] / attacked_states(rules, episode)
    metrics.worst_zone_impact = 0.0
    for i in range(n):
        share = episode.squared_by_zone[i] / attacked_states(rules, episode)
        metrics.worst_zone_impact = max(metrics.worst_zone_impact, share)
    metrics.mean_abs_error_c = absolute / (n * (episode.step[0] + 1))
    metrics.energy_kwh = episode.energy_j[0] / 3.6e6
