"""The strongest stealthy attack on MTD2: a convex quadratic is maximised over an intersection of ellipsoids.

The local optimum comes by sequential linearisation, each step a second-order cone program.
The bound is Shor's relaxation of the same problem, a semidefinite program; it holds for the mean field and its knots.

The data of the program say what biases do to MTD2 and to the building, as matrices. The attacker shows the true
temperature minus a bias, which is linear between knots. Without noise of its own, a set of one forged sensor s errs by
e_s(k) = sum over t of W_s[t] b_s(k - N_e + t), W_s[t] = A^N_e (O'O)^-1 (A^t)' e_zone(s), so that its residual (4.32) is
the square of something linear in the bias.
"""

from __future__ import annotations

import warnings
from typing import Any, NamedTuple

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.types import FloatArray
from cps_envs.hvac.building import discretise
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.controller import gains
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.model import build_model
from cps_envs.hvac.moving_horizon import window_gain
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import attack_order, membership, sensor_sets, zones_of_sensors


class Response(NamedTuple):
    """For m forged sensors with q knots each: p = m q numbers b, sensor by sensor."""

    sensors: tuple[int, ...]  # numbers from 1, (m,)
    course: FloatArray  # (K, q) bias over time of each knot; zero before the onset
    gram: (
        FloatArray  # (m, k from k_0 to K - 2, q, q): b_s' gram b_s is the sum of the set's residuals so far, less noise
    )
    room: FloatArray  # (m, k) C2, what the threshold leaves for it
    shift: FloatArray  # (T_a n, p) what each number moves the temperatures from the onset on, mean field
    error: FloatArray  # (T_a n,) C, x - x_r without an attack
    states: int  # T_a

    def impact(self, b: FloatArray) -> float:
        """A_impact (4.19), C2, of the mean field under biases b (p,)."""
        return float(((self.error + self.shift @ b) ** 2).sum() / self.states)

    def biases(self, b: FloatArray) -> FloatArray:
        """Biases (K, m), C, of numbers b (p,)."""
        found: FloatArray = self.course @ b.reshape(len(self.sensors), -1).T
        return found


def respond(config: HvacConfig, knot_steps: int = 40) -> Response:
    """The matrices of a configuration whose attack is certain; knots are `knot_steps` apart.

    Raises:
        ConfigurationError: an onset, a number or a choice of compromised sensors that is drawn, sensors that are no set
            of their own, or a model that is not exact.
    """
    onset, count = _certain(config)
    sensors, sets = attack_order(config)[:count], sensor_sets(config)
    model, K, N = build_model(config), config.num_steps, config.window_steps
    course = hats(K, onset, knot_steps)
    q = course.shape[1]
    intact = sum(not set(members) & set(sensors) for members in sets)
    steps = np.arange(N, K - 1)
    gram, room = np.empty((count, len(steps), q, q)), np.empty((count, len(steps)))
    shift = np.empty((K, config.num_zones, count * q))
    for place, sensor in enumerate(sensors):
        zone = int(model.zone[sensor - 1])
        weight = window_weights(config, sets.index((sensor,)))
        errors = window_errors(weight, course)  # (K, n, q)
        seen = errors[steps, zone] - course[steps]  # (k, q)
        gram[place] = np.cumsum(seen[:, :, np.newaxis] * seen[:, np.newaxis], axis=0)
        honest = np.array([(steps - N + t < onset) for t in range(N)])  # (N, k)
        noise = float(model.noise_c[sensor - 1]) ** 2 * (honest.T @ weight[:, zone] ** 2 + (steps < onset))
        room[place] = config.threshold_c2 * np.arange(1, len(steps) + 1) - np.cumsum(noise)
        shift[:, :, place * q : (place + 1) * q] = closed_loop(config, errors / (intact + count))
    error = undisturbed(config) - model.reference[:K]
    return Response(
        sensors, course, gram, room, shift[onset:].reshape(-1, count * q), error[onset:].reshape(-1), K - onset
    )


def hats(steps: int, onset: int, apart: int) -> FloatArray:
    """Functions (steps, q) that are 1 at one knot, 0 at the others, and linear between them, from the onset on."""
    knots = np.append(np.arange(onset, steps - 1, apart), steps - 1)
    course: FloatArray = np.stack([np.interp(np.arange(steps), knots, unit) for unit in np.eye(len(knots))], axis=1)
    course[:onset] = 0.0
    return course


def window_weights(config: HvacConfig, index: int) -> FloatArray:
    """W[t] (N_e, n): what a reading t steps into the window moves the estimate of the set `index` of one sensor."""
    return window_gain(discretise(config).A, config.window_steps, membership(config)[index], zones_of_sensors(config))


def window_errors(weight: FloatArray, course: FloatArray) -> FloatArray:
    """How much too cold (K, n, q) the estimate is at each step, from the biases of its window; 0 before it is full."""
    steps, N = len(course), len(weight)
    errors = np.zeros((steps, weight.shape[1], course.shape[1]))
    for k in range(N, steps):
        errors[k] = weight.T @ course[k - N : k]
    return errors


def closed_loop(config: HvacConfig, colder: FloatArray) -> FloatArray:
    """How much warmer (K, n, q) the zones get when what the controller is fed is `colder` (K, n, q) than the truth.

    The heating has no limits here, and is not rounded.
    """
    building = discretise(config)
    K_e, K_d, *_ = gains(building, config.prediction_steps, config.move_weight)
    warmer, heating, before = np.zeros_like(colder), np.zeros(colder.shape[1:]), np.zeros(colder.shape[1:])
    for k in range(len(colder) - 1):
        fed = warmer[k] - colder[k]
        heating = heating - K_e @ fed - K_d @ (fed - before)
        warmer[k + 1] = building.A @ warmer[k] + building.B[:, np.newaxis] * heating
        before = fed
    return warmer


def undisturbed(config: HvacConfig) -> FloatArray:
    """Temperatures (K, n), C, of a day without attack and without noise."""
    rows: list[FloatArray] = []

    def note(game: object) -> None:
        assert isinstance(game, HvacGame)
        rows.append(game.state.temperature[0].copy())

    quiet: HvacConfig = HVAC.config("paper", {**vars(config), "noise_std_c": 0.0})
    play_episodes(HVAC, quiet, {"attacker": "none", "defender": "none"}, (0,), on_step=note)
    return np.array(rows)


def _certain(config: HvacConfig) -> tuple[int, int]:
    onset, count = config.onset_step, config.num_compromised
    drawn = config.random_compromise or config.compromised_weights or config.model_error or config.unmeasured_heat_w
    if not isinstance(onset, int) or not isinstance(count, int) or drawn or config.heat_drift_w:
        raise ConfigurationError(
            "the optimal stealthy attack needs an exact model and an attack that is certain: give one number as "
            "onset_step and as num_compromised, and leave out what is drawn, as preset `paper` does"
        )
    return onset, count


ROUNDS, SETTLED = 30, 1e-6
TYPICAL_C = 10.0  # the relaxation's unit of a bias, so that its numbers are near 1
EVERY = 4  # steps between residuals that the bound takes into account: leaving some out only raises it
GROWTH = 10.0 ** np.arange(-12, 4)  # by which multipliers grow until they certify


class Optimum(NamedTuple):
    """An attack, what it does in the mean field, and what none of its kind can exceed."""

    b: FloatArray  # (p,)
    impact_c2: float
    bound_c2: float


class Quadratic(NamedTuple):
    """Maximise z'Wz over z = (b, 1) with b'F_k b <= 1 for all k."""

    objective: FloatArray  # W (p + 1, p + 1)
    forms: FloatArray  # F (k, p, p)


def solve(response: Response) -> Optimum:
    """The attack that sequential linearisation finds from the relaxation's leading direction, and the bound."""
    import cvxpy as cp

    problem = quadratic(response)
    start, multipliers = relaxed(cp, problem)
    b = refined(cp, response, start)
    return Optimum(b, response.impact(b), certified(problem, multipliers))


def quadratic(response: Response) -> Quadratic:
    """The problem in the unit `TYPICAL_C`, with the A_impact as its objective."""
    count, steps, q, _ = response.gram[:, ::EVERY].shape
    W, shift = np.empty((count * q + 1, count * q + 1)), TYPICAL_C * response.shift
    W[:-1, :-1], W[:-1, -1] = shift.T @ shift, shift.T @ response.error
    W[-1, :-1], W[-1, -1] = W[:-1, -1], response.error @ response.error
    forms = np.zeros((count, steps, count * q, count * q))
    for place in range(count):
        part = slice(place * q, (place + 1) * q)
        room = response.room[place, ::EVERY, np.newaxis, np.newaxis]
        forms[place, :, part, part] = TYPICAL_C**2 * response.gram[place, ::EVERY] / room
    return Quadratic(W / response.states, forms.reshape(-1, count * q, count * q))


def relaxed(cp: Any, problem: Quadratic) -> tuple[FloatArray, FloatArray]:
    """The leading direction (p,) of Shor's relaxation, and the multipliers (k,) of its constraints."""
    p, scale = problem.forms.shape[1], np.abs(problem.objective).max()
    lifted = cp.Variable((p + 1, p + 1), PSD=True)
    within = problem.forms.reshape(-1, p * p) @ cp.vec(lifted[:p, :p], order="C") <= 1.0
    program = cp.Problem(cp.Maximize(cp.trace(problem.objective / scale @ lifted)), [within, lifted[p, p] == 1])
    with warnings.catch_warnings():  # about its accuracy: `certified` needs none
        warnings.simplefilter("ignore", UserWarning)
        program.solve(solver=cp.CLARABEL)
    leading = np.linalg.eigh(lifted.value[:p, :p])[1][:, -1]
    return leading * np.sign(problem.objective[:p, p] @ leading), scale * np.asarray(within.dual_value)


def certified(problem: Quadratic, multipliers: FloatArray) -> float:
    """An upper bound by weak duality, whatever the multipliers (k,) are: no accuracy of a solver enters.

    With M = W - sum of l_k F_k for l >= 0, z'Wz <= sum of l_k + z'Mz. That is at most the sum plus the Schur complement
    of M, where its part without the 1 is negative definite. The multipliers grow until it is; infinity if it never is.
    """
    known = np.maximum(multipliers, 0.0)
    for growth in GROWTH:
        weights = known + growth * (known + known.max())
        M = problem.objective.copy()
        M[:-1, :-1] -= np.tensordot(weights, problem.forms, 1)
        if np.linalg.eigvalsh(M[:-1, :-1]).max() < 0.0:
            return float(weights.sum() + M[-1, -1] - M[-1, :-1] @ np.linalg.solve(M[:-1, :-1], M[:-1, -1]))
    return np.inf


def refined(cp: Any, response: Response, start: FloatArray) -> FloatArray:
    """The biases (p,), C, at which the linearised impact has its maximum, all of them within the room."""
    count, q = response.gram.shape[0], response.gram.shape[2]
    b, slope = cp.Variable(count * q), cp.Parameter(count * q)
    limits = []
    for place in range(count):
        roots = _roots(response.gram[place] / response.room[place][:, np.newaxis, np.newaxis])  # (k, q, q)
        stretched = roots.reshape(-1, q) @ b[place * q : (place + 1) * q]
        limits.append(cp.norm(cp.reshape(stretched, (len(roots), q), order="C"), axis=1) <= 1.0)
    problem = cp.Problem(cp.Maximize(slope @ b), limits)
    found: FloatArray = TYPICAL_C * start / np.abs(start).max()
    impact = -np.inf
    for _ in range(ROUNDS):
        gradient = response.shift.T @ (response.error + response.shift @ found)
        slope.value = gradient / np.abs(gradient).max()
        problem.solve(solver=cp.CLARABEL)
        found = np.asarray(b.value)
        if response.impact(found) <= impact * (1.0 + SETTLED):
            break
        impact = response.impact(found)
    return found


def _roots(forms: FloatArray) -> FloatArray:
    """R with R'R = form of each positive semidefinite form (k, q, q)."""
    values, vectors = np.linalg.eigh(forms)
    roots: FloatArray = np.sqrt(np.maximum(values, 0.0))[:, :, np.newaxis] * vectors.transpose(0, 2, 1)
    return roots
