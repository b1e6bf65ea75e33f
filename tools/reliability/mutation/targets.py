"""Which modules are mutated, and the tests nearest to each."""

from __future__ import annotations

from dataclasses import dataclass

FEW, ALL = 10, 10_000  # mutants of a module
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
SEEN_DISBANDING = (
    *_of(
        "tests/disbanding/test_game.py",
        "attacker_rows_are_in_the_paper_s_numbering",
        "defender_sees_vehicles_front_to_rear_and_the_broadcast_ahead",
        "swarm_rows_agree_with_the_state",
        "privileged_tells_what_episodes_hide",
    ),
    *_of(
        "tests/disbanding/test_radio.py",
        "what_the_radio_is_like_shows_before_an_attack_in_the_silence_alone",
        "silence_tells_a_jam_from_peace_in_both_forms",
        "the_jam_moves_and_ends_with_its_budget",
    ),
    *_of("tests/disbanding/test_circumstances.py", "attacks_open_late_and_keep_a_pause"),
)
STARTED_DISBANDING = _of(
    "tests/disbanding/test_circumstances.py",
    "a_start_is_drawn_from_its_own_generator_in_one_order",
    "an_episode_begins_with_nothing_counted_whatever_was_before",
    "publicly_known_is_the_middle_of_what_is_drawn",
)
SEEN_FDI = (
    *_of(
        "tests/fdi/test_game.py",
        "observations_reach_as_far_as_what_they_show",
        "the_attacker_sees_true_errors_what_they_command_and_its_injection",
        "the_largest_injections_are_seen_as_one",
        "the_defender_sees_what_is_reported_and_how_far_it_lies_off_the_model",
        "masks_offer_the_legal_levels_of_each_sensor_in_turn",
        "drawn_tasks_are_observed_and_masked",
    ),
    *_of("tests/fdi/test_duel.py", "a_lie_works_one_step_later_and_not_before_the_onset"),
)
SENSORS_FDI = _of(
    "tests/fdi/test_duel.py",
    "sensors_read_as_they_are_written",
    "a_rear_sensor_of_either_kind_is_one_and_other_texts_are_refused",
    "vehicles_follow_what_front_and_rear_sensors_tell_them",
)
STARTED_FDI = _of(
    "tests/fdi/test_duel.py",
    "an_episode_is_drawn_from_its_own_generator_in_one_order",
    "a_generator_is_used_where_anything_is_left_to_chance",
)
SEEN_HVAC = _of(
    "tests/hvac/test_game.py",
    "of_equal_sets_the_earlier_ones_are_in_the_better_half",
    "observations_reach_as_far_as_what_they_show",
    "the_attacker_sees_the_loop_as_it_is",
    "defender_sees_what_moving_targets_need",
    "attacker_sees_everything_or_its_own_sensors",
    "the_attack_is_active_when_the_next_reading_counts",
    "the_attacker_sees_the_choice_only_where_it_may",
    "presets_hide_the_choice_where_heat_drifts",
)
STARTED_HVAC = _of(
    "tests/hvac/test_game.py",
    "an_episode_is_drawn_from_its_own_generator_in_one_order",
    "an_episode_begins_with_nothing_counted_whatever_was_before",
    "noise_does_not_depend_on_what_anybody_does_or_on_the_attack",
    "learning_draws_within_its_ranges",
    "the_paper_s_group_is_a_prefix_of_the_order",
    "readings_of_the_start_are_never_forged",
)
SENSORS_HVAC = (
    *_of("tests/hvac/test_config.py", "there_are_as_many_sets_as_sensors", "sets_of_sensors_in_a_row_go_round"),
    *_of(
        "tests/hvac/test_config.py",
        "too_many_sets_have_to_be_named",
        "sets_have_at_most_one_sensor_of_a_zone_and_not_of_all",
    ),
    *STARTED_HVAC,
)
MOVED_ROGUE = ("tests/rogue/test_dynamics.py", "tests/rogue/test_reference.py")
LANES_ROGUE = (
    *_of("tests/rogue/test_lanes.py", "an_episode_goes_into_a_lane_and_comes_back"),
    *_of("tests/rogue/test_reference.py", "standing_vehicles"),
)
SEEN_ROGUE = _of(
    "tests/rogue/test_game.py",
    "the_attacker_sees_its_own_surroundings",
    "the_defender_sees_every_pair_and_vehicle",
    "swarm_rows_agree_with_the_central_view",
    "the_noise_of_each_reading_has_a_number_of_its_own",
)
STARTED_ROGUE = _of(
    "tests/rogue/test_game.py",
    "an_episode_begins_in_a_perturbed_row_with_nothing_counted",
    "a_start_is_drawn_as_it_is_written",
    "learning_draws_within_its_ranges",
    "the_attacker_sees_its_own_surroundings",
)
EXPLOITED = _of(
    "tests/agents/test_league_response.py",
    "a_response_is_the_best_only_where_it_gains",
    "validation_chooses_the_best_of_all_and_fresh_episodes_judge_it",
    "known_policies_that_cannot_play_are_left_out_with_the_reason",
    "an_opponent_that_cannot_play_is_an_error",
    "gains_over_a_league_count_both_intervals",
)
SCORED = _of(  # the others of this file freeze tracks, which takes minutes in plain Python
    "tests/agents/test_scoring.py",
    "a_score_weighs_what_the_best_answers_get_more",
    "the_line_names_the_worst_opponent_and_how_few_seeds_there_are",
    "differences_are_taken_on_the_same_episodes_where_they_can_be",
    "a_file_has_what_the_score_says_with_few_digits",
    "each_training_seed_plays_its_part_and_progress_counts_them_all",
)
VERDICTS = (
    *_of(
        "tests/baselines/test_exhibit.py",
        "what_left_the_reference_fails_unless_it_always_was_outside",
        "near_is_twice_the_tolerance",
        "rule_of_numbers",
        "rule_of_cases",
        "a_tolerance_is_shown_with_its_unit",
    ),
    *_of("tests/disbanding/test_reproduction.py", "recovery_is_for_good_and_by_both_shares"),
)
TARGETS = (
    Target("cps_envs/core/game/match.py", _core(*CORE), 40),
    Target(
        "cps_envs/core/interfaces/vector_env.py",
        _core("reset_masks", "environments", "frame_skip", "edges", "rendering"),
        40,
    ),
    Target("cps_envs/core/declare/actions.py", _core("actions")),
    Target("cps_envs/core/compute/clock.py", _core("clock", "match", "environments")),
    Target("cps_envs/core/policies/mixture.py", _core("mixture", "policy")),
    Target("cps_envs/core/compute/streams.py", _core("streams")),
    Target("cps_envs/core/compute/generators.py", _core("generators", "streams")),
    Target("cps_envs/core/declare/fields.py", _core("fields")),
    Target(
        "agents/cps_agents/zoo/network.py", ("tests/agents/test_zoo_network.py", "tests/agents/test_zoo_damage.py"), 40
    ),
    Target(
        "cps_envs/disbanding/dynamics.py", ("tests/disbanding/test_contact.py", "tests/disbanding/test_reference.py")
    ),
    Target("cps_envs/disbanding/payoff.py", DISBANDING, ALL),
    Target("cps_envs/disbanding/observation.py", SEEN_DISBANDING, FEW),
    Target("cps_envs/disbanding/start.py", STARTED_DISBANDING, FEW),
    Target("cps_envs/fdi/dynamics.py", ("tests/fdi/test_correcting.py", *FDI)),
    Target("cps_envs/fdi/payoff.py", FDI, ALL),
    Target("cps_envs/fdi/observation.py", SEEN_FDI, FEW),
    Target("cps_envs/fdi/sensors.py", SENSORS_FDI, FEW),
    Target("cps_envs/fdi/drawing.py", STARTED_FDI, FEW),
    Target("cps_envs/hvac/dynamics.py", HVAC),
    Target("cps_envs/hvac/payoff.py", ("tests/hvac/test_payoff.py",), ALL),
    Target("cps_envs/hvac/observation.py", SEEN_HVAC, FEW),
    Target("cps_envs/hvac/sensors.py", SENSORS_HVAC, FEW),
    Target("cps_envs/hvac/start.py", STARTED_HVAC, FEW),
    Target("cps_envs/rogue/dynamics.py", MOVED_ROGUE),
    Target("cps_envs/rogue/lanes.py", LANES_ROGUE),
    Target("cps_envs/rogue/payoff.py", ROGUE, ALL),
    Target("cps_envs/rogue/observation.py", SEEN_ROGUE, FEW),
    Target("cps_envs/rogue/start.py", STARTED_ROGUE, FEW),
    Target("agents/cps_agents/arena/statistics.py", ("tests/agents/test_evaluation_statistics.py",), 40),
    Target("agents/cps_agents/league/equilibrium.py", ("tests/agents/test_league_equilibrium.py", *VALUE), 40),
    Target("agents/cps_agents/league/exploitability.py", EXPLOITED, FEW),
    Target("agents/cps_agents/scoring/score.py", SCORED, FEW),
    Target("paper/cps_paper/verdicts.py", VERDICTS, FEW),
    Target(
        "tools/coverage/simulation.py",
        _of("tests/tools/test_coverage.py", "intervals_are_counted_by_side", "the_command_writes_and_refuses"),
        FEW,
    ),
)
