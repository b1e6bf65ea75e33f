"""The state of a batch of buildings, as plain arrays that numba kernels work on in place."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import inlined, maker, records, room
from cps_envs.core.declare.measures import Measure
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.hvac.model import CHUNK, Model, Rules


class Metrics(NamedTuple):
    """What `info` tells of an episode so far."""

    a_impact: Annotated[
        float, Measure("°C²", "(4.19): squared error from the set-point, summed over zones, mean since the onset")
    ]
    mean_abs_error_c: Annotated[float, Measure("°C", "error from the set-point, mean over zones and time")]
    energy_kwh: Annotated[float, Measure("kWh", "heating, and cooling")]
    distinct_sets: Annotated[float, Measure("", "sensor sets chosen at some time; each Kalman filter counts as one")]
    flawed_steps: Annotated[
        float, Measure("", "steps since the onset in which a set with a compromised sensor was chosen")
    ]
    model_steps: Annotated[float, Measure("", "steps with a full window in which no sensor was believed")]
    rejecting_steps: Annotated[
        float, Measure("", "steps with a full window in which no set had a mean residual below the threshold")
    ]
    onset_step: Annotated[float, Measure("", "step at which the attack begins, t_0")]
    num_compromised: Annotated[float, Measure("", "compromised sensors")]
    discomfort_h: Annotated[
        float, Measure("h", "hours since the onset outside comfort_c of the set-point, summed over zones")
    ]
    attack_kwh: Annotated[float, Measure("kWh", "heating, and cooling, since the onset")]
    worst_zone_impact: Annotated[float, Measure("°C²", "largest share of one zone in a_impact")]


class State(NamedTuple):
    """B episodes, at state x(k).

    Of the C = sets + 2 + F choices, 0 is the raw readings, the next are the sets, then come the model and the F Kalman
    filters, and last the thermostats, if there are any. Courses that a configuration leaves out have no rows.

    Residuals count from k = N_e on, when the window is full, and are zero before that. Before that, too, the estimates
    of all choices but 0 are those of the recursive least squares.
    """

    step: IntArray  # (B,) k
    first: IntArray  # (B,) sample of the courses of `Model` at which the episode begins
    onset: IntArray  # (B,) t_0
    compromised: BoolArray  # (B, S)
    plant: FloatArray  # (B, n, n) A_p
    heat: FloatArray  # (B, n) W, unmeasured, the same all day
    heat_drift: FloatArray  # (B, K or 0, n) W, unmeasured, what comes to it
    outdoor_error: FloatArray  # (B, K or 0) C, outside temperature minus forecast
    series: FloatArray  # (B, K, S) up to k the residual readings r_s, C; beyond k noise to come, standard normal
    mark: FloatArray  # (B, chunks + 1, S n) C, sums of a block of N_e samples from each chunk on, see `window`
    tail: FloatArray  # (B, CHUNK, S n) C, the same from each sample of the present chunk on
    head: FloatArray  # (B, S n) C, sums of the next block up to k - 1
    temperature: FloatArray  # (B, n) C, x(k)
    forced: FloatArray  # (B, n) C, F(k)
    integrator: FloatArray  # (B, n) W, u_c(k - 1)
    heating: FloatArray  # (B, n) W, u(k - 1), as commanded
    supplied: FloatArray  # (B, n) W, what the zones got of it
    shift: FloatArray  # (B, n) C, by which the attacker moved the set-points that the controller heard at k - 1
    denied: BoolArray  # (B, 2) messages that did not arrive: readings of k, commands of k - 1
    plan: FloatArray  # (B, N or 0, n) W, of a controller that plans: u_c(k - 1) and what was to follow
    measured: FloatArray  # (B, S) C, before forging
    reading: FloatArray  # (B, S) C, after forging
    recursive: FloatArray  # (B, n) C, z of the recursive least squares before the window is full
    covariance: FloatArray  # (B, n, n) its covariance in units of sigma^2
    estimate: FloatArray  # (B, C, n) C, xh(k) of every choice
    previous: FloatArray  # (B, C, n) C, xh(k - 1) of every choice
    fed: FloatArray  # (B, n) C, the estimate that the controller got at k - 1
    filtered: FloatArray  # (B, F, 2n) C and W, temperatures and unmeasured heat by each Kalman filter, after k
    innovation: FloatArray  # (B, F, S) reading minus prediction of each filter at k, in standard deviations
    innovation_mean: FloatArray  # (B, F, S) its exponentially weighted mean
    residual: FloatArray  # (B, sets) C2, J_a(k)
    residual_sum: FloatArray  # (B, sets) C2, of J_a since N_e
    mean_residual: FloatArray  # (B, sets) C2, Jm_a(k) of (4.33): the sum by the number of its terms
    choice: IntArray  # (B,) at k - 1
    used: BoolArray  # (B, C) chosen at some time
    squared_error: FloatArray  # (B,) C2, sum of |x - x_r|^2 since the onset
    squared_by_zone: FloatArray  # (B, n) C2, the same zone by zone
    absolute_error: FloatArray  # (B, n) C, sum of |x - x_r| since k = 0
    energy_j: FloatArray  # (B,) heating, and cooling, since k = 0
    metrics: Array  # (B,) records of Metrics


class Scratch(NamedTuple):
    """Room that a call of a kernel works in, one environment after the other."""

    sums: FloatArray  # (S n,) h_s by modes
    vector: FloatArray  # (n,)
    change: FloatArray  # (n,) C, dxh(k)
    matrix: FloatArray  # (n, n)


def allocate(num_envs: int, model: Model, rules: Rules, *, drifting: bool = False, misforecast: bool = False) -> State:
    """A state with every array zero; the start of an episode fills it.

    `drifting` and `misforecast` make room for courses of unmeasured heat and of the forecast's error.
    """
    envs, steps = num_envs, rules.num_steps
    sets, sensors = model.member.shape
    n, filters = len(model.B), len(model.filter_member)
    choices = sets + 2 + filters + rules.thermostats

    def zeros(*shape: int) -> FloatArray:
        return np.zeros((envs, *shape))

    return State(
        step=np.zeros(envs, np.int64),
        first=np.zeros(envs, np.int64),
        onset=np.zeros(envs, np.int64),
        compromised=np.zeros((envs, sensors), np.bool_),
        plant=zeros(n, n),
        heat=zeros(n),
        heat_drift=zeros(steps if drifting else 0, n),
        outdoor_error=zeros(steps if misforecast else 0),
        series=zeros(steps, sensors),
        mark=zeros(-(-(len(model.decay) - 1) // CHUNK) + 1, sensors * n),
        tail=zeros(CHUNK, sensors * n),
        head=zeros(sensors * n),
        temperature=zeros(n),
        forced=zeros(n),
        integrator=zeros(n),
        heating=zeros(n),
        supplied=zeros(n),
        shift=zeros(n),
        denied=np.zeros((envs, 2), np.bool_),
        plan=zeros(rules.plan_steps, n),
        measured=zeros(sensors),
        reading=zeros(sensors),
        recursive=zeros(n),
        covariance=zeros(n, n),
        estimate=zeros(choices, n),
        previous=zeros(choices, n),
        fed=zeros(n),
        filtered=zeros(filters, 2 * n),
        innovation=zeros(filters, sensors),
        innovation_mean=zeros(filters, sensors),
        residual=zeros(sets),
        residual_sum=zeros(sets),
        mean_residual=zeros(sets),
        choice=np.zeros(envs, np.int64),
        used=np.zeros((envs, choices), np.bool_),
        squared_error=zeros(),
        squared_by_zone=zeros(n),
        absolute_error=zeros(n),
        energy_j=zeros(),
        metrics=records(Metrics, envs),
    )


@inlined
def on_the_spot(rules: Rules, episode: State) -> bool:
    """Whether thermostats heat since the last choice of the defender."""
    return bool(rules.thermostats and episode.choice[0] == len(episode.estimate) - 1)


@maker
def make_scratch(model: Model) -> Scratch:
    """Room for a call of a kernel, its contents of no meaning."""
    n = model.A.shape[1]
    return Scratch(room(model.decay.shape[1]), room(n), room(n), room((n, n)))
