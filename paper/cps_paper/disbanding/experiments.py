"""What the chapter simulates, under one interpretation of what it leaves open, and the results.

`PlanSearch` solves (2.9) on the plain law by the genetic algorithm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from cps_baselines.disbanding.genetic import GivenPlans
from cps_baselines.disbanding.plan_search import Evaluate, SearchResult, SearchSettings, search_plan
from cps_envs.core.game.play import play_episodes
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.problem import DISBANDING
from cps_paper.disbanding.played import DEFENDERS, READINGS, PlayedReading, PlayedScenario
from cps_paper.disbanding.scenario import CONTROLLERS, Attack, Recorded, Scenario
from cps_paper.evidence import Evidence, Experiment

DEFAULT = SearchSettings()
DISTINCT_PLANS = 0.6  # of the plans that a search looks at; the others it has seen before


@dataclass(frozen=True)
class PlanSearch:
    """A seeded search for the plan of `budget` disbandings with the largest E_v over all vehicles, without defence."""

    budget: int
    tau_s: float
    interpretation: str = "S0"
    seed: int = 0
    settings: SearchSettings = DEFAULT

    @property
    def cost(self) -> float:
        """How long it takes, relative to scenarios."""
        plans = self.settings.population * self.settings.generations
        return DISTINCT_PLANS * plans * self.scenario.cost

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"genetic algorithm, K = {self.budget}, tau = {self.tau_s:g} s"

    @property
    def scenario(self) -> Scenario:
        """What is attacked."""
        return Scenario((), tau_s=self.tau_s, interpretation=self.interpretation)

    def run(self) -> SearchResult:
        """Search."""
        config = self.scenario.config
        return search_plan(
            evaluator(self.scenario),
            num_platoons=config.max_platoons,
            budget=self.budget,
            latest_s=int(config.duration_s),
            seed=self.seed,
            settings=self.settings,
        )


def evaluator(scenario: Scenario) -> Evaluate:
    """A function from plans, disbanding times (P, N) of the paper's platoons 1..N, to E_v over all vehicles (P,)."""
    config = scenario.config
    spec = DISBANDING.game(config, 1).spec("attacker")

    def evaluate(plans: FloatArray) -> FloatArray:
        found = play_episodes(DISBANDING, config, {"attacker": GivenPlans(spec, plans)}, [0] * len(plans))
        return found["velocity_error_all"]

    return evaluate


ATTACKS: dict[str, Attack] = {"2.2": ((10, 1.0),), "2.3": ((10, 2.0), (9, 100.0))}
CELLS = ((5.0, 0.1), (5.0, 0.3), (5.0, 0.5), (4.0, 0.1), (4.0, 0.3), (4.0, 0.5))  # (x_d in m, tau in s), as printed
TAUS_S = (0.1, 0.3, 0.5)  # Table 2.1
FIGURE_TAUS_S = (0.1, 0.2, 0.3, 0.4, 0.5)  # Figs. 2.3c, d
STRINGS = (20, 50, 80)  # platoons in Fig. 2.1d
PLATOONS = tuple(range(2, 11))  # N in Figs. 2.3c, d
LATER_S = (2.0, 5.0, 10.0, 20.0, 60.0, 120.0)  # single attacks that might be better than one at 1 s
SECOND_PLANS = tuple((platoon, float(time)) for platoon in range(9, 0, -1) for time in range(20, 181, 20))
BUDGETS = (1, 2)  # platoons that the genetic algorithm may disband
ATTACK_S = 2.0  # Figs. 2.1 and 2.3a, b


@dataclass(frozen=True)
class DisbandingEvidence(Evidence):
    """The chapter's experiments by name, under one interpretation, and their results."""

    interpretation: str = "S0"
    all_interpretations: bool = False  # of the baseline

    def under(self, interpretation: str) -> DisbandingEvidence:
        """The same results, read under another interpretation."""
        return replace(self, interpretation=interpretation)

    def cell(self, table: str, controller: str, desired_gap_m: float, tau_s: float) -> Scenario:
        """A cell of Table 2.2 or 2.3."""
        return Scenario(ATTACKS[table], tau_s, desired_gap_m, controller, self.interpretation)

    def string(self, num_platoons: int) -> Recorded:
        """Fig. 2.1a-d: the lead platoon is disbanded; long enough for recovery where there is one."""
        duration_s = {20: 1200.0, 50: 2700.0, 80: 4500.0}[num_platoons]
        return Recorded(
            ((num_platoons, ATTACK_S),),
            interpretation=self.interpretation,
            num_platoons=num_platoons,
            duration_s=duration_s,
            sample_s=0.2 if num_platoons == STRINGS[0] else 1.0,
        )

    def every_other(self, tau_s: float) -> Recorded:
        """Fig. 2.1e: every other one of 20 platoons is disbanded, 30 s apart."""
        attack = tuple((20 - 2 * i, ATTACK_S + 30.0 * i) for i in range(10))
        return Recorded(attack, tau_s, interpretation=self.interpretation, num_platoons=STRINGS[0], duration_s=600.0)

    def rear_speeds(self, attack: Attack) -> Recorded:
        """Figs. 2.3a, b."""
        return Recorded(attack, interpretation=self.interpretation)

    def single(self, num_platoons: int, tau_s: float, platoon: int | None = None, time_s: float = 1.0) -> Scenario:
        """One platoon disbanded, the lead one if not given; Figs. 2.3c, d and the search for something better."""
        attack = ((platoon or num_platoons, time_s),)
        return Scenario(attack, tau_s, interpretation=self.interpretation, num_platoons=num_platoons)

    def second(self, tau_s: float, platoon: int, time_s: float) -> Scenario:
        """The lead platoon at 2 s and another one later."""
        return Scenario(((10, ATTACK_S), (platoon, time_s)), tau_s, interpretation=self.interpretation)

    def search(self, budget: int, tau_s: float) -> PlanSearch:
        """The genetic algorithm."""
        return PlanSearch(budget, tau_s, self.interpretation)

    def defended(self, num_platoons: int, tau_s: float, defender: str) -> PlayedScenario:
        """The lead platoon of N disbanded at 1 s, against a defender."""
        return PlayedScenario(
            defender, tau_s, (("num_platoons", num_platoons), ("interpretation", self.interpretation))
        )

    def reading(self, reading: PlayedReading, tau_s: float, defender: str) -> PlayedScenario:
        """What the text describes, against a defender."""
        return reading.played(defender, tau_s, self.interpretation)

    def table(self, table: str, controllers: tuple[str, ...] = CONTROLLERS) -> list[Experiment[Any]]:
        """All cells of a table."""
        return [self.cell(table, controller, *cell) for controller in controllers for cell in CELLS]

    def figure_2_1(self) -> list[Experiment[Any]]:
        """Everything behind Fig. 2.1; `quick` leaves out the strings of 50 and 80 platoons."""
        strings = [self.string(count) for count in (STRINGS[:1] if self.quick else STRINGS)]
        return [*strings, *(self.every_other(tau_s) for tau_s in TAUS_S[:2])]

    def figure_2_3(self) -> list[Experiment[Any]]:
        """Everything behind Fig. 2.3."""
        courses = [self.rear_speeds(attack) for attack in (((10, ATTACK_S),), ATTACKS["2.3"])]
        return [*courses, *(self.single(count, tau_s) for tau_s in FIGURE_TAUS_S for count in PLATOONS)]

    def platoons(self) -> list[Experiment[Any]]:
        """Every defender for every N."""
        return [self.defended(n, tau_s, name) for name in DEFENDERS for tau_s in TAUS_S for n in PLATOONS]

    def readings(self) -> list[Experiment[Any]]:
        """Every defender under every reading of the text."""
        return [self.reading(each, tau_s, name) for each in READINGS for tau_s in TAUS_S for name in DEFENDERS]

    def one_platoon(self) -> list[Experiment[Any]]:
        """Attacks that might be better than the lead platoon at 1 s: any other platoon, or the lead one later."""
        cases = [(count, tau_s) for tau_s in FIGURE_TAUS_S for count in PLATOONS]
        platoons = [self.single(count, tau_s, platoon) for count, tau_s in cases for platoon in range(1, count)]
        return [*platoons, *(self.single(count, tau_s, time_s=time_s) for count, tau_s in cases for time_s in LATER_S)]

    def two_platoons(self) -> list[Experiment[Any]]:
        """Attacks on the lead platoon at 2 s and any other one at the seconds of SECOND_PLANS."""
        return [self.second(tau_s, platoon, time_s) for tau_s in TAUS_S for platoon, time_s in SECOND_PLANS]

    def paper_plan(self, budget: int, tau_s: float) -> Scenario:
        """The attack that the paper calls optimal with one or two platoons."""
        return self.single(10, tau_s) if budget == 1 else self.second(tau_s, *ATTACKS["2.3"][1])

    def paper_plans(self) -> list[Experiment[Any]]:
        """All of them."""
        return [self.paper_plan(budget, tau_s) for budget in BUDGETS for tau_s in TAUS_S]

    def searches(self) -> list[Experiment[Any]]:
        """The genetic algorithm with one and two platoons; `quick` is a single search."""
        every: list[Experiment[Any]] = [self.search(budget, tau_s) for budget in BUDGETS for tau_s in TAUS_S]
        return every[:1] if self.quick else every
