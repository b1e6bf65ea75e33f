"""A controller of your own in one file: the dissertation's model predictive control of a platoon, in NumPy and OSQP.

Behind a disbanded platoon a central computer goes through the vehicles from front to rear, ten times a second. For each
one that closes in on its predecessor it solves the quadratic program of appendix A. It knows what is observed, and
nothing else. Change a weight, a constraint or the model, and compare:

    pip install osqp
    python examples/own_mpc.py            # the return of three episodes, beside that of `mpc` and of no defence
    PYTHONPATH=examples cps-envs --trust play disbanding --preset paper --attacker lead --defender own_mpc:OwnMpc
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import osqp
from scipy import sparse

import cps_envs
from cps_envs import AnalyticPolicy, Seen, find_problem, play_episodes, types

N, T_S = 5, 0.1  # horizon in periods, and the sampling time T_s (s) for which a command is held
Q = np.diag([1.0, 5.0, 0.0])  # price of errors of gap (m), speed (m/s) and acceleration (m/s2), (A.9)
Y = Q  # the same at the end of the horizon
R = 0.1  # price of a command (m/s2)


class Program(NamedTuple):
    """Predicted errors of a vehicle behind another, `free @ e + own @ U + ahead * u_(i-1)`, and the solver."""

    free: types.Array  # (3N, 3) Abar of (A.10)
    own: types.Array  # (3N, N) Bbar_1
    ahead: types.Array  # (3N,) Bbar_2 times ones: the predecessor keeps its command
    weights: types.Array  # (3N, 3N) Qbar of (A.11)
    solver: osqp.OSQP


@lru_cache
def program(tau_s: float) -> Program:
    """Everything that is constant for one lag of the actuators."""
    A = np.array([[1, T_S, 0], [0, 1, T_S], [0, 0, 1 - T_S / tau_s]])  # (A.2) with e = (predecessor's) - (own)
    B1 = np.array([0, 0, -T_S / tau_s])  # B_2 = -B_1
    powers = [np.linalg.matrix_power(A, m) for m in range(N + 1)]
    free = np.vstack(powers[1:])  # (A.10)
    own = np.zeros((3 * N, N))
    for m in range(N):
        for k in range(m + 1):
            own[3 * m : 3 * m + 3, k] = powers[m - k] @ B1
    weights = np.kron(np.eye(N), Q)  # (A.11)
    weights[-3:, -3:] = Y
    M2 = R * np.eye(N) + own.T @ weights @ own  # (A.12)
    rows = np.vstack([own[6::3], own[4::3], np.eye(N)])  # gaps (A.5), speeds (A.6) and (A.7), commands (A.8)
    solver, none = osqp.OSQP(), np.zeros(len(rows))
    exact = {"eps_abs": 1e-9, "eps_rel": 1e-9, "max_iter": 10_000, "verbose": False}
    solver.setup(sparse.csc_matrix(np.triu(M2)), np.zeros(N), sparse.csc_matrix(rows), none - 1, none + 1, **exact)
    return Program(free, own, -own.sum(axis=1), weights, solver)


class OwnMpc(AnalyticPolicy):
    """Brakes each vehicle behind a disbanded platoon as appendix A finds best."""

    def act(self, seen: Seen, state: types.State | None) -> tuple[types.Array, types.State | None]:
        """Actions (B, M): what is added to the commands of M vehicles, as shares of u_max - u_min."""
        config = self.spec.config
        actions = np.zeros((len(seen), config.max_vehicles))
        for b in np.flatnonzero(seen["mitigable"].any(axis=1)):
            actions[b] = self.sweep({name: seen[name][b] for name in SIGNALS})
        return actions / (config.max_acceleration_mps2 - config.min_acceleration_mps2), state

    def sweep(self, now: dict[str, types.Array]) -> types.Array:
        """The corrections (M,) in m/s2 of the vehicles of one episode, front to rear."""
        config, law = self.spec.config, now["law_command"]
        corrections, ahead = np.zeros(len(law)), law[0]
        for q in range(1, len(law)):
            gap, closing, n = now["gap"][q - 1], now["relative_speed"][q - 1], config.vehicles_per_platoon
            if q >= n and now["mitigable"][q - n] and closing < 0:
                corrections[q] = self.command(now, q, gap, closing, ahead) - law[q]
            speed, before = now["speed"][q], now["speed"][q - 1]
            near = config.standstill_gap_m - (speed**2 - before**2) / (2 * config.min_acceleration_mps2)  # (2.6)
            ahead = config.min_acceleration_mps2 if gap <= near else law[q] + corrections[q]
        return corrections

    def command(self, now: dict[str, types.Array], q: int, gap: float, closing: float, ahead: float) -> float:
        """The command (m/s2) of vehicle `q`, whose predecessor has the command `ahead`."""
        config, speed, lag = self.spec.config, now["speed"], float(np.round(now["tau_s"], 5))
        low, high = config.min_acceleration_mps2, config.max_acceleration_mps2
        leads = q % config.vehicles_per_platoon == 0
        wanted = config.headway_s * speed[q] if leads else now["desired_gap_m"]
        e = np.array([gap - wanted, closing, now["acceleration"][q - 1] - now["acceleration"][q]])  # (A.1)
        if speed[q - 1] <= 0:  # who stands does not brake
            ahead = max(ahead, 0.0)
        p = program(lag)
        errors = p.free @ e + p.ahead * ahead  # (A.10) for U = 0
        speeds, v, a = np.zeros(N), speed[q - 1], now["acceleration"][q - 1]
        for m in range(N):  # of the predecessor, in (A.6) and (A.7)
            v, a = v + T_S * a, a + T_S / lag * (ahead - a)
            speeds[m] = v
        least = [-wanted - errors[6::3], speeds[1:] - config.max_speed_mps - errors[4::3], np.full(N, low)]
        most = [np.full(N - 2, np.inf), speeds[1:] - errors[4::3], np.full(N, high)]
        p.solver.update(
            q=p.own.T @ p.weights @ errors, l=np.concatenate(least), u=np.concatenate(most)
        )  # M_1 of (A.12)
        found = p.solver.solve(raise_error=False)
        if found.info.status != "solved":  # no command keeps all limits
            return float(low)
        return float(np.clip(found.x[0], low, high))


SIGNALS = ("speed", "acceleration", "gap", "relative_speed", "law_command", "mitigable", "tau_s", "desired_gap_m")


def main() -> None:
    """Print what an attack on the front of three platoons is paid (points of E_v), for three lags of the actuators."""
    disbanding = find_problem("disbanding")
    cps_envs.trust()  # `own_mpc:OwnMpc` is code of your own
    for tau_s in (0.1, 0.3, 0.5):
        config = disbanding.config("paper", {"tau_s": tau_s, "num_platoons": 3})
        for defender in ("none", "mpc", f"{__name__}:OwnMpc"):
            players: Any = {"attacker": "lead", "defender": defender}
            (returned,) = play_episodes(disbanding, config, players, [0])["return"]
            print(f"lag {tau_s} s, {defender:>15}: {returned:6.3f}")


if __name__ == "__main__":
    main()
