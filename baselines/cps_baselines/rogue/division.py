"""How a platoon divides the laws once somebody in it is suspected."""

from __future__ import annotations

from typing import NamedTuple

from cps_baselines.rogue.assignment import laws_of
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.kernels import Record, inlined
from cps_envs.core.types import FloatArray, IntArray

NOBODY = -1  # no vehicle is suspected
FAR_BEHIND, BEHIND, AHEAD, FAR_AHEAD, LEADER = range(5)  # the suspect


class Division(NamedTuple):
    """Laws (k, 2) before anybody is suspected and around a suspect, and when its neighbours are in danger."""

    before: IntArray  # (1, 2) of all
    apart: IntArray  # (5, 2): far behind, just behind, just ahead, far ahead of the suspect, and of the leader
    evade: IntArray  # (5, 2) the same, on the side on which the suspect is about to collide
    near_m: float  # a gap error below this is danger
    horizon_s: float  # and one that will be below it so soon


def division_of(before: str, apart: str, evade: str, near_m: float, horizon_s: float) -> Division:
    """The laws that three options name.

    Raises:
        ConfigurationError: unknown letters, or another number of them.
    """
    letters = {"before": (before, 1), "apart": (apart, 5), "evade": (evade, 5)}
    for option, (given, count) in letters.items():
        if len(given) != count:
            raise ConfigurationError(
                f"{option} = {given!r} has to have {count} of the letters. Of five, they are the laws far behind the "
                "suspect, just behind, just ahead, far ahead, and of the leader"
            )
    laws = {option: laws_of(given, option) for option, (given, _) in letters.items()}
    return Division(**laws, near_m=float(near_m), horizon_s=float(horizon_s))


@inlined
def divide(laws: Division, suspect: int, values: FloatArray, at: Record, count: int, orders: IntArray) -> None:
    """Fill the orders (2 N,) of a platoon of `count`; `suspect` is from the rear (0) or `NOBODY`, `values` is seen."""
    behind, ahead = in_danger(laws, suspect - 1, values, at, count), in_danger(laws, suspect, values, at, count)
    for i in range(count):
        if i < suspect:
            place = FAR_BEHIND if i < suspect - 1 else BEHIND
        elif i < count - 1:
            place = AHEAD if i <= suspect + 1 else FAR_AHEAD
        else:
            place = LEADER
        law = laws.evade[place] if (behind if i < suspect else ahead) else laws.apart[place]
        if suspect == NOBODY:
            law = laws.before[0]
        orders[2 * i], orders[2 * i + 1] = law[0], law[1]


@inlined
def in_danger(laws: Division, pair: int, values: FloatArray, at: Record, count: int) -> bool:
    """Whether the gap error of a pair is small, or will be soon."""
    if pair < 0 or pair >= count - 1:
        return False
    closing = min(values[at.gap_rate + pair], 0.0)
    return bool(values[at.gap_error + pair] + laws.horizon_s * closing < laws.near_m)
