"""Who plays preset `learning` of the disbanding problem: attacks, jams, defenders and constants."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping

from cps_baselines.arena import Contestant
from cps_envs.core.types import Role
from cps_envs.disbanding.config import LEARNING
from tools.rivals import Rivals

ATTACKS = LEARNING.num_attacks
LEVELS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # shares of 6 m/s2, of either sign

ATTACKERS = (
    *(Contestant(name) for name in ("none", "lead", "table_2_3", "spread", "random", "timed", "adaptive")),
    Contestant("jam_first", "timed?jam=1", "timed, jam behind the first"),
    Contestant("jam_second", "timed?jam=2", "timed, jam behind the next"),
    Contestant("jam_after", "timed?jam=3&jam_s=0", "timed, jam after the attack"),
    Contestant("jam_soon", "timed?jam=1&jam_s=0&pause_s=40", "timed, every 40 s, jam after the first"),
    Contestant(
        "jam_adaptive",
        "adaptive?look_s=20&slow_mps=8.2&fast_mps=18.1&slow_s=60&middle_s=35&fast_s=35&jam=1",
        "adaptive, soon, jam behind the first",
    ),
)
DEFENDERS = tuple(map(Contestant, ("none", "heuristic", "mpc", "copy", "feedback", "string", "local")))


def constant_corrections() -> Iterator[str]:
    """The same correction of all vehicles, of the leaders, of the others, and of the rear half."""
    size, vehicles = LEARNING.vehicles_per_platoon, LEARNING.max_vehicles
    leaders = [float(q % size == 0) for q in range(vehicles)]
    rear = [float(q >= vehicles // 2) for q in range(vehicles)]
    for level in sorted((*LEVELS, *(-level for level in LEVELS))):
        yield f"always?action={level}"
        for shares in (leaders, [1.0 - share for share in leaders], rear):
            yield f"always?action={json.dumps([level * share for share in shares], separators=(',', ':'))}"


RIVALS: Mapping[Role, Rivals] = {
    "attacker": Rivals(policies=ATTACKERS, constants=tuple(f"always?action={action}" for action in range(ATTACKS))),
    "defender": Rivals(
        policies=(
            *DEFENDERS,
            Contestant("cacc"),
            Contestant("cacc_start", "cacc?untrained=true"),
            Contestant("cacc_radio", "cacc?told=radio"),
            Contestant("cacc_radio_start", "cacc?told=radio&untrained=true"),
        ),
        constants=tuple(constant_corrections()),
        informed=(Contestant("informed"),),
    ),
}
