"""Game steps of a batch of platoons: episodes side by side in lanes, as far as there are enough of one size."""

from __future__ import annotations

import numpy as np

from cps_envs.core.compute.kernels import borrowed, kernel, lend, room, unpack
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.rogue.dynamics import advance_lanes, receive
from cps_envs.rogue.lanes import WIDTH, WORTH, load, make_block, make_plants, store
from cps_envs.rogue.payoff import measure
from cps_envs.rogue.state import Drawn, Rules, State, platoon


@kernel
def step(
    state: State,
    drawn: Array,
    rules: Array,
    leader_mps: FloatArray,
    moves: tuple[FloatArray, IntArray, FloatArray],
    envs: BoolArray,
    periods: int,
    scores: Array,
    payoff: FloatArray,
) -> None:
    """Advance the marked environments (B,) by game steps; write what the attacker is paid (B,).

    `moves` are the attacker's actions (B, seats) in [-1, 1]; of the k vehicles that get orders controllers (B, k, 2)
    and whether they are modified; and accelerations (B, k) in m/s2, where the controller is `COMMANDED`. References
    follow the series `leader_mps` (K,) where there is one.
    """
    attack, orders, accelerations = moves
    r, most = unpack(Rules, rules, 0), state.position.shape[1]
    lanes = WIDTH if envs.size >= WORTH else 1
    block, plants = make_block(most, lanes), make_plants(state.length_m.shape[1], lanes)
    places = room(envs.size, np.int64)
    for n in range(2, most + 1):
        total = 0
        for b in range(envs.size):
            if envs[b] and borrowed(drawn)[b].num_vehicles == n:
                places[total], total = b, total + 1
        first = 0
        while first < total:
            wide = total - first >= WORTH
            width = WIDTH if wide else 1
            count = min(width, total - first)
            rows = borrowed(places)[first : first + count]
            for k in range(width):
                b = rows[min(k, count - 1)]
                load(lend(block), lend(plants), state, drawn, b, k, n)
                c, order, acceleration = unpack(Drawn, drawn, b), borrowed(orders)[b], borrowed(accelerations)[b]
                receive(lend(block), state, order, acceleration, b, k, n, c, r)
            acts = (rows, attack, borrowed(leader_mps))
            if wide:  # two calls, so that the compiler knows the width in each
                advance_lanes(lend(block), lend(plants), state, drawn, scores, *acts, periods, n, WIDTH, r)
            else:
                advance_lanes(lend(block), lend(plants), state, drawn, scores, *acts, periods, n, 1, r)
            for k in range(count):
                store(lend(block), state, rows[k], k, n)
            first += count
    for b in range(envs.size):
        if envs[b]:
            c, score = unpack(Drawn, drawn, b), borrowed(scores)[b]
            before = score.damage + score.formation_charge
            measure(platoon(state, b, c.num_vehicles), score, c, r)
            payoff[b] = score.damage + score.formation_charge - before
