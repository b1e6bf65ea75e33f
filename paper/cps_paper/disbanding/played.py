"""Episodes of the environment itself, for what the chapter describes in words: no table prints their numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace

from cps_envs.core.declare.config import configure
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import Role
from cps_envs.disbanding.config import PRESETS, DisbandingConfig
from cps_envs.disbanding.problem import DISBANDING
from cps_paper.disbanding.scenario import Overrides

COSTS = {"none": 1.0, "heuristic": 2.0, "mpc": 15.0, "copy": 2.0, "feedback": 2.0, "string": 2.0}  # relative
DEFENDERS = tuple(COSTS)


@dataclass(frozen=True)
class PlayedScenario:
    """The lead platoon is disbanded at 1 s, against a defender who acts every 0.1 s; means over seeds from 0."""

    defender: str = "none"
    tau_s: float = 0.1
    overrides: Overrides = ()
    preset: str = "paper"
    episodes: int = 1

    @property
    def config(self) -> DisbandingConfig:
        """That of the environments."""
        known = {"tau_s": self.tau_s, "report": "full", **dict(self.overrides)}
        return configure(PRESETS[self.preset], known)

    @property
    def cost(self) -> float:
        """How long it takes, relative to others."""
        config = self.config
        return COSTS[self.defender] * self.episodes * config.max_platoons * config.horizon_steps

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"{self.defender}, N = {self.config.max_platoons}, tau = {self.tau_s:g} s"

    def run(self) -> dict[str, float]:
        """The metrics at the end."""
        players: dict[Role, PolicyReference] = {"attacker": "lead", "defender": self.defender}
        found = play_episodes(DISBANDING, self.config, players, range(self.episodes))
        return {name: float(values.mean()) for name, values in found.items()}


@dataclass(frozen=True)
class PlayedReading:
    """Something that the text describes and that preset `paper` leaves out."""

    name: str
    overrides: Overrides = ()
    preset: str = "paper"
    episodes: int = 1

    def played(self, defender: str, tau_s: float, interpretation: str) -> PlayedScenario:
        """It, against a defender."""
        played = PlayedScenario(defender, tau_s, self.overrides, self.preset, self.episodes)
        return replace(played, overrides=(*self.overrides, ("interpretation", interpretation)))


BRAKING = (("braking_share", 0.3), ("braking_mps2", (2.0, 5.0)), ("braking_s", (0.5, 1.5)))
READINGS = (
    PlayedReading("preset paper"),
    PlayedReading("a step of 5 ms", (("dt_s", 0.005),)),
    PlayedReading("standstill rule (r_0)", (("standstill_rule", True),)),
    PlayedReading("transitional controllers", (("transitional_controller", True),)),
    PlayedReading("leader's sensor, 0.1 s per link", (("member_delay_s", 0.1),)),
    PlayedReading("rear vehicle's sensor, 0.1 s per link", (("member_delay_s", 0.1), ("attacked_member", 10))),
    PlayedReading("leader's sensor, 0.5 s per link", (("member_delay_s", 0.5),)),
    PlayedReading("rear vehicle's sensor, 0.5 s per link", (("member_delay_s", 0.5), ("attacked_member", 10))),
    PlayedReading("30 % of the drivers brake", BRAKING, episodes=20),
    PlayedReading("preset one_vehicle", preset="one_vehicle", episodes=20),
)
