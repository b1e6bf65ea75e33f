"""The central mitigation of 2.4.1 in earnest: one program for all vehicles behind a disbanded platoon, told everything.

`mpc` is appendix A as printed: one vehicle after the other, each against the vehicle ahead. The text of 2.4.1 asks for
more: a central computer that has the measurements of all vehicles and minimises their velocity deviation. This is it.
"""

from __future__ import annotations

import numpy as np

from cps_baselines.disbanding.joint_plan import Forecast, Motions, PlanNumbers, plan_episode
from cps_baselines.disbanding.joint_program import JointSettings, design_joint, joint_scratch
from cps_envs.core.compute.kernels import pack, view
from cps_envs.core.declare.config import bounds
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, told_of
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Generators, Knowledge, State
from cps_envs.disbanding.start import nominal_constants

# Appendix A's horizon, period and weights, as `mpc` has them, for all vehicles at once.
PAPER = JointSettings(
    horizon=5,
    period_s=0.1,
    command_weight=0.1,
    gap_weight=1.0,
    closing_weight=5.0,
    speed_weight=0.0,
    keeps_headway=True,
    may_hurry=True,
    least_gap_m=0.0,
    braces=False,
)
# Chosen by what they reach, see the documentation. The horizon has to cover a stop from v_d, 6 s at full braking.
BEST = JointSettings(
    horizon=10,
    period_s=1.0,
    command_weight=0.1,
    gap_weight=0.1,
    closing_weight=1.0,
    speed_weight=0.1,
    keeps_headway=False,
    may_hurry=False,
    least_gap_m=3.0,
    braces=True,
)
WEIGHTS = {"best": BEST, "paper": PAPER}
MOVES = ("position", "speed", "acceleration")
HALF = 0.5  # of an entry that is 0 or 1


class Joint(AnalyticPolicy):
    """Plans the commands of all vehicles behind each disbanded platoon together, and again at every decision.

    Told the truth: where everybody is and which platoons are disbanded, at once. It predicts human drivers by (2.5) and
    what lies ahead of them by its own plan. Once as many platoons are disbanded as `attack_budget` may allow, leaders
    no longer keep a reserve for the next attack. `weights` is "best" or "paper" (those of appendix A), `settings`
    replaces them.

    Raises:
        ConfigurationError: other weights, or an environment that takes one correction per platoon.
    """

    privileged = frozenset({"truth"})

    def __init__(self, spec: RoleSpec, *, weights: str = "best", settings: JointSettings | None = None) -> None:
        super().__init__(spec)
        config = spec.config
        if config.defense_action != "vehicle":
            raise ConfigurationError(f'{type(self).__name__} corrects vehicles; it needs defense_action="vehicle"')
        if weights not in WEIGHTS:
            raise ConfigurationError(f"weights = {weights!r} is not known. {near(weights, WEIGHTS)}")
        self.settings = settings or WEIGHTS[weights]
        self.limit_mps2 = config.max_acceleration_mps2 - config.min_acceleration_mps2
        self._constants = pack(nominal_constants(config))
        self._knobs = pack(PlanNumbers(*(getattr(self.settings, name) for name in PlanNumbers._fields)))
        self._most_attacks = bounds(config.attack_budget)[1]
        self._shape = config.max_vehicles, self.settings.horizon
        self._scratch = joint_scratch(*self._shape)
        self._prediction = Forecast(*np.zeros((2, config.max_vehicles, self.settings.horizon + 1)))

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """What tells the truth of episodes (B,), plans (B, M, H) in m/s2, multipliers (B, 3, M, H), residuals (B,)."""
        envs = len(knowledge)
        return told_of(knowledge), np.zeros((envs, *self._shape)), np.zeros((envs, 3, *self._shape)), np.zeros(envs)

    def beliefs(self, state: State) -> dict[str, Array]:
        """The largest residual (B,) of the last decision's programs, see `solve_joint`."""
        return {"residual": state[3]}

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, M): corrections as shares of u_max - u_min."""
        told, plans, multipliers, residual = state
        truths = [each["truth"] for each in told]
        actions = np.zeros((len(seen), self.spec.config.max_vehicles))
        disbanded = np.isfinite(np.stack([truth["disbanding_s"] for truth in truths]))
        if not disbanded.any():
            return actions, state
        plans, multipliers, residual = plans.copy(), multipliers.copy(), residual.copy()
        size = self.spec.config.vehicles_per_platoon
        position, speed, acceleration = (np.stack([truth[name] for truth in truths]) for name in MOVES)
        motions = Motions(position, speed, acceleration, seen["law_command"], np.repeat(disbanded, size, axis=1))
        absent = np.sum(seen["present"] < HALF, axis=1) if "present" in seen else np.zeros(len(seen), np.int64)
        taus_s = np.round(seen["tau_s"], 5).tolist()  # the rounding of float32 observations is not a new lag
        for b in np.flatnonzero(disbanded.any(axis=1)).tolist():
            residual[b] = plan_episode(
                view(motions, b),
                int((disbanded.shape[1] - absent[b]) * size),
                design_joint(self.settings, taus_s[b], self.spec.config.max_vehicles),
                float(seen["desired_gap_m"][b]),
                self.settings.braces and int(disbanded[b].sum()) < self._most_attacks,
                self._constants,
                self._knobs,
                self._prediction,
                plans[b],
                multipliers[b],
                self._scratch,
                actions[b],
            )
        return np.clip(actions / self.limit_mps2, -1.0, 1.0), (told, plans, multipliers, residual)
