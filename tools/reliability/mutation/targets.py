"""Which modules are mutated, and the tests nearest to each."""

from __future__ import annotations

from dataclasses import dataclass

CORE = ("match", "environments", "frame_skip", "mixture", "policy_state")


@dataclass(frozen=True)
class Target:
    """A module and the tests that have to notice a mutant, quick and near ones first.

    Its kernels run as plain Python (NUMBA_DISABLE_JIT=1), so that a mutant costs no compilation.
    """

    path: str
    tests: tuple[str, ...]  # files, or tests of them as in "file::test"
    mutants: int = 20  # drawn from all

    @property
    def module(self) -> str:
        """Its name for `import`."""
        inside = self.path.removeprefix("agents/").removeprefix("baselines/").removeprefix("paper/")
        return inside.removesuffix(".py").replace("/", ".")


def _of(file: str, *names: str) -> tuple[str, ...]:
    return tuple(f"{file}::test_{name}" for name in names)


def _core(*names: str) -> tuple[str, ...]:
    return tuple(f"tests/core/test_{name}.py" for name in names)


# In plain Python other tests of these files take minutes.
DISBANDING = _of(
    "tests/disbanding/test_game.py",
    "what_is_measured_is_what_the_state_says",
    "charges_follow_their_formula",
    "a_collision_ends_the_episode_and_charges_the_rest",
    "a_platoon_is_disbanded_once_and_the_budget_ends",
    "local_swarm_rewards_are_the_vehicles_own_errors",
)
ROGUE = _of(
    "tests/rogue/test_game.py",
    "what_is_measured_is_what_the_state_says",
    "only_where_nobody_knows_the_attacker_is_it_told_who_attacks",
    "learning_draws_within_its_ranges",
    "the_payoff_is_damage_plus_the_price_of_scattering",
)
FDI = tuple(f"tests/fdi/test_{name}.py" for name in ("game", "model", "duel", "instability"))
HVAC = (
    *_of("tests/hvac/test_disturbance.py", "the_plant_follows_the_drawn_courses"),
    *_of("tests/hvac/test_planning.py", "the_first_step_of_a_plan_is_applied", "fine_levels_are_none"),
    "tests/hvac/test_reference.py",
    "tests/hvac/test_building.py",
)
VALUE = _of(
    "tests/agents/test_league_value.py",
    "a_single_episode_has_a_value_and_no_interval",
    "nobody_chooses_on_the_episodes_that_it_is_valued_on",
    "limits_are_student_s",
)
TARGETS = (
    Target("cps_envs/core/match.py", _core(*CORE), 40),
    Target(
        "cps_envs/core/interfaces/vector_env.py",
        _core("reset_masks", "environments", "frame_skip", "edges", "rendering"),
        40,
    ),
    Target("cps_envs/core/actions.py", _core("actions")),
    Target("cps_envs/core/clock.py", _core("clock", "match", "environments")),
    Target("cps_envs/core/mixture.py", _core("mixture", "policy")),
    Target("cps_envs/core/streams.py", _core("streams")),
    Target("cps_envs/core/generators.py", _core("generators", "streams")),
    Target("cps_envs/core/fields.py", _core("fields")),
    Target(
        "agents/cps_agents/zoo/network.py", ("tests/agents/test_zoo_network.py", "tests/agents/test_zoo_damage.py"), 40
    ),
    Target(
        "cps_envs/disbanding/dynamics.py", ("tests/disbanding/test_contact.py", "tests/disbanding/test_reference.py")
    ),
    Target("cps_envs/disbanding/payoff.py", DISBANDING),
    Target("cps_envs/fdi/dynamics.py", ("tests/fdi/test_correcting.py", *FDI)),
    Target("cps_envs/fdi/payoff.py", FDI),
    Target("cps_envs/hvac/dynamics.py", HVAC),
    Target("cps_envs/hvac/payoff.py", ("tests/hvac/test_payoff.py",)),
    Target("cps_envs/rogue/dynamics.py", ("tests/rogue/test_dynamics.py", "tests/rogue/test_reference.py")),
    Target("cps_envs/rogue/payoff.py", ROGUE),
    Target("agents/cps_agents/arena/statistics.py", ("tests/agents/test_evaluation_statistics.py",), 40),
    Target("agents/cps_agents/league/equilibrium.py", ("tests/agents/test_league_equilibrium.py", *VALUE), 40),
)
