"""The moving-horizon observer in forward form as constant matrices, one set of sensors each, (4.20) to (4.29).

With F the response forced by the known heating and weather, the residual readings r_s(k) = y_s(k) - F(k) of a window
obey r = O_a z + noise, z being the homogeneous part at its start. Least squares and N_e steps forward give
xh_a(k) = F(k) + A^N_e pinv(O_a) r = F(k) + A^N_e (O_a' O_a)^-1 sum over s in a of h_s, with the sums
h_s = sum over t of (A^t)' e_zone(s) r_s(k - N_e + t) shared by all sets. No power of A^-1 occurs.

The sums square cond(O_a). Sets that hardly observe the building apply A^N_e pinv(O_a) to the window itself instead.
"""

from __future__ import annotations

import warnings

import numpy as np

from cps_envs.core.types import BoolArray, FloatArray, IntArray

MAX_CONDITION = 1e4


class ObservabilityWarning(UserWarning):
    """Some sets of sensors say next to nothing about some zone."""


def powers(A: FloatArray, count: int) -> FloatArray:
    """A^t for t = 0..count, (count + 1, n, n)."""
    result = np.empty((count + 1, *A.shape))
    result[0] = np.eye(len(A))
    for t in range(count):
        result[t + 1] = A @ result[t]
    return result


def observability(rows: FloatArray, sensors: BoolArray, zone: IntArray) -> FloatArray:
    """O_a (N_e |a|, n): e_zone(s)' A^t for the window's t and the marked sensors (S,); `rows` are A^t (N_e, n, n)."""
    return rows[:, zone[sensors]].reshape(-1, rows.shape[-1])


def set_gains(A: FloatArray, window: int, member: BoolArray, zone: IntArray) -> tuple[FloatArray, FloatArray]:
    """A^N_e (O_a' O_a)^-1, (sets, n, n), and cond(O_a), (sets,), of every set of `member` (sets, S).

    Directions that a set does not see at all are left at the forced response.
    """
    all_powers = powers(A, window)
    gain, condition = np.empty((len(member), *A.shape)), np.empty(len(member))
    for a, sensors in enumerate(member):
        R = np.linalg.qr(observability(all_powers[:window], sensors, zone), mode="r")  # has the same values and V
        _, singular, V = np.linalg.svd(R)
        seen = singular > singular[0] * np.finfo(float).eps * len(V) * window
        inverse = np.divide(1.0, singular**2, out=np.zeros_like(singular), where=seen)
        gain[a] = all_powers[window] @ (V.T * inverse) @ V
        condition[a] = singular[0] / singular[-1] if seen.all() else np.inf
    return gain, condition


def window_gain(A: FloatArray, window: int, sensors: BoolArray, zone: IntArray) -> FloatArray:
    """A^N_e pinv(O_a) transposed, (N_e |a|, n): what each reading of the window moves the estimate of a set (S,)."""
    all_powers = powers(A, window)
    gain: FloatArray = (all_powers[window] @ np.linalg.pinv(observability(all_powers[:window], sensors, zone))).T
    return np.ascontiguousarray(gain)


def window_gains(
    A: FloatArray, window: int, member: BoolArray, zone: IntArray, condition: FloatArray
) -> tuple[FloatArray, IntArray]:
    """The `window_gain` of all sets (sets, S) that hardly observe, below each other, and where each begins (sets,).

    Sets that the shared sums serve have -1.
    """
    rows, begin = [np.empty((0, len(A)))], np.full(len(member), -1)
    for a in np.flatnonzero(condition > MAX_CONDITION):
        begin[a] = sum(map(len, rows))
        rows.append(window_gain(A, window, member[a], zone))
    return np.concatenate(rows), begin


def warn_if_blind(condition: FloatArray, sets: tuple[tuple[int, ...], ...]) -> None:
    """Warn about the sets whose cond(O_a) exceeds 1e4: their estimates amplify noise beyond use."""
    blind = [sensors for sensors, number in zip(sets, condition, strict=True) if number > MAX_CONDITION]
    if blind:
        named = ", ".join(map(str, blind[:4])) + (", ..." if len(blind) > 4 else "")
        warnings.warn(
            f"{len(blind)} of {len(sets)} sensor sets hardly observe the building, with cond(O_a) up to "
            f"{condition.max():.1e}: {named}. Make zones differ in capacity and links, lengthen window_steps, or name "
            "better sensor_sets.",
            ObservabilityWarning,
            stacklevel=2,
        )
