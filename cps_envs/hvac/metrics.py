"""What is measured: A_impact (4.19), and what tells how it came about."""

from __future__ import annotations

from cps_envs.core.compiled import inlined
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
def mean_residual(model: Model, lane: State, a: int) -> float:
    """Jm_a(k), C2: the mean of the residuals of a set since k_0 = N_e, (4.33); k_0 counts too."""
    return float(lane.residual_sum[a] / (lane.step[0] - len(model.window) + 1))


@inlined
def passes(model: Model, lane: State, a: int) -> bool:
    """Whether the mean residual of a set is at most the threshold."""
    return mean_residual(model, lane, a) <= model.threshold_c2


@inlined
def count_choice(model: Model, lane: State) -> None:
    """Take note of the choice at k, once the window is full."""
    if not is_ready(model, lane):
        return
    sets, a = len(model.member), lane.choice[0] - 1
    if 0 <= a < sets:
        lane.used[a] = True
        flawed = False
        for s in range(len(model.zone)):
            flawed |= model.member[a, s] and lane.compromised[s]
        lane.counts[FLAWED] += flawed and lane.step[0] >= lane.onset[0]
    lane.counts[MODEL] += a == sets
    found = False
    for other in range(sets):
        found |= passes(model, lane, other)
    lane.counts[REJECTING] += not found


@inlined
def count_errors(model: Model, lane: State) -> float:
    """Add the errors of x(k) to the sums; returns the attacker's payoff for them."""
    square = 0.0
    for i in range(len(lane.temperature)):
        error = lane.temperature[i] - model.reference_c
        square += error * error
        lane.absolute_error[i] += abs(error)
    if lane.step[0] < lane.onset[0]:
        return 0.0
    lane.squared_error[0] += square
    return square / attacked_states(model, lane)


@inlined
def attacked_states(model: Model, lane: State) -> int:
    """T_a: number of states from the onset to the end."""
    return int(len(model.weather) - lane.onset[0])


@inlined
def measure(model: Model, lane: State, out: FloatArray) -> None:
    """Fill `out` (len(METRICS),) with the metrics so far."""
    n = len(lane.temperature)
    out[0] = lane.squared_error[0] / attacked_states(model, lane)
    out[1] = lane.absolute_error.sum() / (n * (lane.step[0] + 1))
    out[2] = lane.energy_j[0] / 3.6e6
    out[3] = lane.used.sum()
    out[4] = lane.counts[FLAWED]
    out[5] = lane.counts[MODEL]
    out[6] = lane.counts[REJECTING]
    out[7] = lane.onset[0]
    out[8] = lane.compromised.sum()
