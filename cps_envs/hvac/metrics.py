"""What is measured: A_impact (4.19), and what tells how it came about."""

from __future__ import annotations

from cps_envs.core.kernels import inlined
from cps_envs.core.types import FloatArray
from cps_envs.hvac.estimation import is_ready
from cps_envs.hvac.model import Model
from cps_envs.hvac.state import State

METRICS = (
    "a_impact",  # C2, (4.19): mean since the onset of |x - x_r|^2 summed over zones; grows to the final value
    "mean_abs_error_c",  # C, |x - x_r| averaged over zones and time so far
    "energy_kwh",  # heating so far
    "distinct_sets",  # sets chosen at some time
    "flawed_steps",  # steps since the onset in which a set with a compromised sensor was chosen
    "model_steps",  # steps with a full window in which the model's prediction was chosen
    "rejecting_steps",  # steps with a full window in which no set had a mean residual below the threshold
    "onset_step",  # t_0
    "num_compromised",  # sensors
)
FLAWED, MODEL, REJECTING = 0, 1, 2  # columns of State.counts


@inlined
def mean_residual(model: Model, episode: State, a: int) -> float:
    """Jm_a(k), C2: the mean of the residuals of a set since k_0 = N_e, (4.33); k_0 counts too."""
    return float(episode.residual_sum[a] / (episode.step[0] - len(model.window) + 1))


@inlined
def passes(model: Model, episode: State, a: int) -> bool:
    """Whether the mean residual of a set is at most the threshold."""
    return mean_residual(model, episode, a) <= model.threshold_c2


@inlined
def count_choice(model: Model, episode: State) -> None:
    """Take note of the choice at k, once the window is full."""
    if not is_ready(model, episode):
        return
    sets, a = len(model.member), episode.choice[0] - 1
    if 0 <= a < sets:
        episode.used[a] = True
        flawed = False
        for s in range(len(model.zone)):
            flawed |= model.member[a, s] and episode.compromised[s]
        episode.counts[FLAWED] += flawed and episode.step[0] >= episode.onset[0]
    episode.counts[MODEL] += a == sets
    found = False
    for other in range(sets):
        found |= passes(model, episode, other)
    episode.counts[REJECTING] += not found


@inlined
def count_errors(model: Model, episode: State) -> float:
    """Add the errors of x(k) to the sums; returns the attacker's payoff for them."""
    square = 0.0
    for i in range(len(episode.temperature)):
        error = episode.temperature[i] - model.reference_c
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
def measure(model: Model, episode: State, out: FloatArray) -> None:
    """Fill `out` (len(METRICS),) with the metrics so far."""
    n = len(episode.temperature)
    out[0] = episode.squared_error[0] / attacked_states(model, episode)
    out[1] = episode.absolute_error.sum() / (n * (episode.step[0] + 1))
    out[2] = episode.energy_j[0] / 3.6e6
    out[3] = episode.used.sum()
    out[4] = episode.counts[FLAWED]
    out[5] = episode.counts[MODEL]
    out[6] = episode.counts[REJECTING]
    out[7] = episode.onset[0]
    out[8] = episode.compromised.sum()
