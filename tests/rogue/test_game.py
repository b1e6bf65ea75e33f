"""The game on the kernels: moves, payoff, draws, copies, and what the roles observe."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cps_envs.core.compute.kernels import records, view
from cps_envs.core.types import Array
from cps_envs.rogue.actions import action_of_effort
from cps_envs.rogue.controllers import DRIVEN, HUMAN, SLIDING
from cps_envs.rogue.fields import vehicle_fields
from cps_envs.rogue.game import RogueGame
from cps_envs.rogue.noise import noise
from cps_envs.rogue.payoff import Metrics, measure
from cps_envs.rogue.problem import ROGUE
from cps_envs.rogue.state import NEVER
from tests import episodes
from tests.rogue.games import go, seen, started

NOISELESS = {"range_noise_m": 0.0, "range_rate_noise_mps": 0.0, "acceleration_noise_mps2": 0.0}


def test_an_effort_holds_until_the_next_decision() -> None:
    game = started(attack_hold_s=0.5)
    assert game.decision_interval == {"attacker": 5, "defender": 1}
    go(game, 1.0)
    for _ in range(4):
        go(game, -1.0)
        assert game.state.effort[0, 2] == 1.0
    go(game, -1.0)
    assert game.state.effort[0, 2] == -1.0


@pytest.mark.parametrize("ratio", [1.0, 1.4])
def test_actions_of_efforts_set_those_efforts(ratio: float) -> None:
    game = started(power_ratio=ratio)
    generator = np.random.default_rng(0)
    for effort in [1.0, -1.0, 0.0, 0.5, *generator.uniform(-1, 1, 20)]:
        view = seen(game, "attacker")
        action = action_of_effort(effort, view["speed"], view["power_ratio"], game.config)
        go(game, action)
        assert game.state.effort[0, 2] == pytest.approx(effort, abs=1e-5)


def test_commands_are_accelerations_up_to_full_effort_at_the_reference_speed() -> None:
    game = started(defense_action="command")
    go(game, 0.0, [1.0, -1.0, 0.0, 0.5])
    efforts = game.state.effort[0, [0, 1, 3, 4]]  # in the last integration step, at nearly the speed of the first one
    assert 5 * efforts - 2.5 == pytest.approx([2.5, -7.5, 0.0, 1.25], abs=0.1)
    assert game.state.speed[0] == pytest.approx([25.25, 24.25, 25, 25, 25.125], abs=0.01)


def test_either_offers_accelerations_beside_the_controllers() -> None:
    """The choices after the six controllers are commands; such a vehicle shows no law, and no other vehicle's."""
    laws, commands = [2, 0, 3, 0, 4, 1, 1, 0], [1.0, -1.0, 0.0, 0.5]
    for form, orders, same in (("command", commands, [10, 0, 6, 0, 8, 0, 9, 0]), ("mode", laws, laws)):
        other, either = started(defense_action=form), started(defense_action="either")
        go(other, -1.0, orders, 5)
        go(either, -1.0, same, 5)
        assert np.array_equal(either.state.position, other.state.position)
        shown = seen(either, "defender")
        assert shown["law"].sum() == (4 if form == "mode" else 0)
        assert form == "command" or np.array_equal(either.observe("defender"), other.observe("defender"))


def test_the_payoff_is_damage_plus_the_price_of_scattering() -> None:
    outcome = episodes.play(ROGUE, "square", "sliding", range(4), "easy", duration_s=20.0)
    assert outcome["return"] == pytest.approx(outcome["damage"] + outcome["formation_charge"])
    assert outcome["formation_charge"] == pytest.approx(0.5 * outcome["formation_cost_s"])
    assert np.all(outcome["formation_cost_s"] > 0)
    assert np.all(outcome["damage_ahead"] <= outcome["damage"])


def test_braking_together_costs_what_the_specification_says() -> None:
    """Specification 8, all brake: the integral of c over 60 s is 38 at ratio 1 and 0.1 Hz."""
    game = started(contact="solid", duration_s=60.0, defense_action="command")
    for period in range(600):
        go(game, 1.0 if period // 50 % 2 == 0 else -1.0, [-1.0] * 4)
    assert game.metrics()["formation_cost_s"] == pytest.approx(38, abs=0.5)


def test_learning_draws_within_its_ranges() -> None:
    game = started(range(60), "easy", attacker_index=(2, 4))
    drawn, vehicles = game.drawn, game.state
    assert set(drawn["attacker"]) == {1, 2, 3}
    ratio = drawn["attacker_drive_mps2"] / drawn["drive_mps2"]
    for values, low, high in (
        (ratio, 1, 1.6),
        (drawn["drive_mps2"], 4.75, 5.25),
        (drawn["drag_per_s"], 0.095, 0.105),
        (drawn["reference_speed_mps"], 20, 30),
        (drawn["onset_step"] * 0.0005, 0, 10),
        (np.diff(vehicles.position), 8.5, 9.5),
        (vehicles.speed - drawn["reference_speed_mps"][:, np.newaxis], -0.2, 0.2),
    ):
        assert low <= values.min()
        assert values.max() <= high
        assert np.ptp(values) > 0.8 * (high - low)


def test_the_attacker_sees_its_own_surroundings() -> None:
    game = started(power_ratio=1.2, onset_s=0.3, dt_s=0.0005)
    go(game, 1.0, num_steps=20)
    shown, vehicles = seen(game, "attacker"), view(game.state, 0)
    x, v = vehicles.position, vehicles.speed
    assert shown["front_gap_error"][0] == pytest.approx(x[3] - x[2] - 9, abs=1e-4)
    assert shown["rear_gap_error"][0] == pytest.approx(x[2] - x[1] - 9, abs=1e-4)
    assert shown["front_gap_rate"][0] == pytest.approx(v[3] - v[2], abs=1e-4)
    assert shown["rear_gap_rate"][0] == pytest.approx(v[2] - v[1], abs=1e-4)
    assert shown["speed"][0] == pytest.approx(v[2], abs=1e-4)
    exact = {"effort": 1.0, "reference_speed": 25, "power_ratio": 1.2, "attacker_index": 3, "time_left_s": 98}
    assert {name: shown[name][0] for name in exact} == pytest.approx(exact, abs=1e-4)
    assert seen(started(onset_s=(7.0, 7.0), dt_s=0.0005), "attacker")["until_onset_s"] == pytest.approx(7.0, abs=1e-4)


@pytest.mark.parametrize("attacker", [1, 2, 3, 4])
def test_the_defender_sees_every_pair_and_vehicle(attacker: int) -> None:
    game = started(attacker_index=attacker, alarm_threshold=20.0, dt_s=0.0005)
    for period in range(30):
        go(game, 1.0 if period < 20 else -1.0, [5, 1] * 4)
    shown, vehicles = seen(game, "defender"), view(game.state, 0)
    intact = [i for i in range(5) if i != attacker - 1]
    assert shown["gap_error"][0] == pytest.approx(np.diff(vehicles.position) - 9, abs=1e-4)
    assert shown["gap_rate"][0] == pytest.approx(np.diff(vehicles.speed), abs=1e-4)
    assert shown["speed"][0] == pytest.approx(vehicles.speed, abs=1e-4)
    assert shown["acceleration"][0] == pytest.approx(np.clip(vehicles.acceleration, -10, 10), abs=1e-4)
    assert shown["reference_error"][0] == pytest.approx(game.metrics()["reference_error_m"][0], abs=1e-4)
    assert shown["alarm"][0].tolist() == vehicles.alarm[intact].tolist()
    assert np.any(shown["alarm"])
    assert shown["growth"][0] == pytest.approx(vehicles.growth[intact], abs=1e-5)
    front = np.minimum(vehicles.front_detector[intact], 60)
    rear = np.minimum(vehicles.rear_detector[intact], 60)
    assert shown["front_detector"][0] == pytest.approx(front[:-1], abs=1e-3)
    assert shown["rear_detector"][0] == pytest.approx(rear if attacker == 1 else rear[1:], abs=1e-3)
    laws = [DRIVEN[law] for law in vehicles.controller[intact]]
    assert [DRIVEN[row.argmax()] for row in shown["law"][0]] == laws
    assert shown["law"].sum() == 4


def test_swarm_rows_agree_with_the_central_view() -> None:
    game = started()
    for _ in range(30):
        go(game, 1.0, [5, 1] * 4)
    team, central, vehicles = game.team("defender"), seen(game, "defender"), view(game.state, 0)
    rows = {name: values[0] for name, values in vehicle_fields(game.config).decode(team.observe()).items()}
    gaps, rates = central["gap_error"][0], central["gap_rate"][0]
    reference = central["reference_error"][0]
    assert rows["front_gap_error"] == pytest.approx([gaps[0], gaps[1], gaps[3], reference], abs=1e-4)
    assert rows["rear_gap_error"] == pytest.approx([0, gaps[0], gaps[2], gaps[3]], abs=1e-4)
    assert rows["front_gap_rate"] == pytest.approx([rates[0], rates[1], rates[3], 25 - vehicles.speed[4]], abs=1e-4)
    assert rows["rear_gap_rate"] == pytest.approx([0, rates[0], rates[2], rates[3]], abs=1e-4)
    a = central["acceleration"][0]
    assert rows["front_acceleration"] == pytest.approx([a[1], a[2], a[4], 0], abs=1e-4)
    assert rows["rear_acceleration"] == pytest.approx([0, a[0], a[2], a[3]], abs=1e-4)
    assert rows["front_detector"][:3] == pytest.approx(central["front_detector"][0], abs=1e-3)
    assert rows["rear_detector"][1:] == pytest.approx(central["rear_detector"][0], abs=1e-3)
    assert rows["leads"].tolist() == [0, 0, 0, 1]
    assert rows["trails"].tolist() == [1, 0, 0, 0]
    for name in ("growth", "law", "alarm"):
        assert rows[name] == pytest.approx(central[name][0], abs=1e-5)


def test_noise_is_what_the_configuration_says_and_does_not_touch_the_physics() -> None:
    noisy, exact = started(range(400), "easy"), started(range(400), "easy", **NOISELESS)
    for game in (noisy, exact):
        go(game, 1.0, [1, 0] * 4, 3)
    assert all(np.array_equal(one, other) for one, other in zip(noisy.state, exact.state, strict=True))
    for role in ("attacker", "defender"):
        assert np.array_equal(noisy.observe(role), noisy.observe(role))
        with_noise, without = seen(noisy, role), seen(exact, role)
        for name, deviation in (("gap_error", 0.05), ("gap_rate", 0.02), ("acceleration", 0.5), ("speed", 0.0)):
            for field in with_noise:
                if field.endswith(name) and not field.startswith("reference"):
                    difference = with_noise[field] - without[field]
                    assert difference.std() == pytest.approx(deviation, rel=0.15, abs=1e-6), field
                    assert abs(difference.mean()) <= deviation / 4


def test_the_noise_of_each_reading_has_a_number_of_its_own() -> None:
    deviations = {"gap_error": 0.3, "gap_rate": 0.2, "acceleration": 0.7, "speed": 0.4}
    names = ("range_noise_m", "range_rate_noise_mps", "acceleration_noise_mps2", "speed_noise_mps")
    noisy = started(preset="easy", **dict(zip(names, deviations.values(), strict=True)))
    exact = started(preset="easy", **dict.fromkeys(names, 0.0))
    for game in (noisy, exact):
        go(game, 1.0, [1, 0] * 4, 3)
    seed, now, n = int(noisy.drawn["noise_seed"][0]), int(noisy.state.step.ravel()[0]), 5
    seats = [i for i in range(n) if i != noisy.drawn["attacker"][0]]

    def drawn(name: str, *numbers: int) -> Array:
        return np.array([noise(deviations[name], seed, now, number) for number in numbers])

    for place, name in enumerate(deviations):  # what the defender sees, from number 1,000 on, one kind after the other
        with_noise, without = (seen(game, "defender")[name][0] for game in (noisy, exact))
        expected = drawn(name, *(1_000 + place * n + i for i in range(with_noise.size)))
        assert with_noise - without == pytest.approx(expected, abs=1e-4), name
    noisy_rows, exact_rows = (
        vehicle_fields(game.config).decode(game.team("defender").observe()) for game in (noisy, exact)
    )
    kinds = ("front_gap_error", "front_gap_rate", "rear_gap_error", "rear_gap_rate", "front_acceleration")
    for place, field in enumerate((*kinds, "rear_acceleration")):  # what vehicles see, six numbers each
        sides = [i for i in seats if (i > 0 if field.startswith("rear") else i < n - 1)]
        expected = drawn(field.partition("_")[2], *(1_000_000 + 6 * i + place for i in sides))
        difference = (noisy_rows[field] - exact_rows[field])[0][[seats.index(i) for i in sides]]
        assert difference == pytest.approx(expected, abs=1e-4), field


@pytest.mark.parametrize(("vehicles", "share"), [(5, 1.0), ((4, 8), 0.5)])
def test_a_start_is_drawn_as_it_is_written(vehicles: Any, share: float) -> None:
    """Number by number with NumPy. Counts and attacks that are certain take no draw."""
    config = ROGUE.config("easy", {"num_vehicles": vehicles, "attacker_index": (1, 3), "attack_share": share})
    game, (generator, own) = RogueGame(config, 1), (np.random.default_rng(7) for _ in range(2))
    game.reset(np.ones(1, bool), [generator])
    count = 5 if vehicles == 5 else own.integers(4, 9)
    attacker, shares, word = own.integers(1, 4) - 1, own.random(5), own.bit_generator.random_raw()
    spacing, speed = own.random((2, config.max_vehicles))
    attacked = share == 1 or own.random() < share
    assert generator.bit_generator.state == own.bit_generator.state
    drawn, state = game.drawn[0], game.state
    assert (drawn["num_vehicles"], drawn["attacker"]) == (count, attacker)
    assert drawn["reference_speed_mps"] == pytest.approx(20 + 10 * shares[3])
    assert drawn["noise_seed"] == np.uint64(word).astype(np.int64)
    assert (drawn["onset_step"] < NEVER) == attacked
    assert state.speed[0, :count] == pytest.approx(drawn["reference_speed_mps"] + 0.2 * (2 * speed - 1)[:count])
    assert np.diff(state.position[0, :count]) == pytest.approx(9 + 0.5 * (2 * spacing - 1)[1:count])


def test_an_episode_begins_in_a_perturbed_row_with_nothing_counted() -> None:
    game = started(preset="learning", spacing_spread_m=2.0, speed_spread_mps=1.5, attack_share=1.0)
    go(game, 1.0, num_steps=40)
    game.reset(np.ones(1, bool), [np.random.default_rng(3)])
    c, r = game.drawn, game.config
    n = int(c["num_vehicles"][0])
    x, v = game.state.position[0, :n], game.state.speed[0, :n]
    assert x[0] == 0.0
    assert x[-1] == c["reference_start_m"][0]
    assert np.all(np.abs(np.diff(x) - r.separation_m) <= 2.0)
    assert np.all(np.abs(v - c["reference_speed_mps"][0]) <= 1.5)
    assert np.ptp(np.diff(x)) > 0.5
    assert np.ptp(v) > 0.5
    assert np.all(game.state.armed[0, : n - 1])
    still = (
        "acceleration",
        "effort",
        "growth",
        "front_detector",
        "rear_detector",
        "damage",
        "alarm",
        "collisions",
        "step",
    )
    for name in still:
        assert not np.any(getattr(game.state, name)), name
    found = game.metrics()
    assert (found["first_collision_s"][0], found["first_alarm_s"][0]) == (-1.0, -1.0)
    assert found["formation_charge"][0] == found["false_alarms"][0] == 0.0


def test_a_scene_is_a_copy() -> None:
    game = started(power_ratio=1.4)
    scene = game.scene(0)
    assert scene.law == ("linear", "linear", "attacker", "linear", "linear")
    go(game, 1.0, [5, 1] * 4, 20)
    later = game.scene(0)
    assert scene.position[0] == 0.0
    assert later.time_s == pytest.approx(2.0)
    assert later.reference_m == pytest.approx(36 + 50)
    assert "sliding" in later.law


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning")
def test_noise_in_plain_python_takes_seeds_below_zero() -> None:
    drawn = [noise(0.05, seed, 3, 0) for seed in (-1609375537816396722, -1, 0, 1)]
    assert len(set(drawn)) == 4
    assert max(map(abs, drawn)) < 0.5


@pytest.mark.parametrize(("step", "attacked"), [(5, 0), (6, 1)])
def test_what_is_measured_is_what_the_state_says(step: int, attacked: int) -> None:
    episode = view(started().state, 0)
    pairs, vehicles = episode.damage.size, episode.alarm.size
    episode.damage[:], episode.collisions[:] = np.arange(1.0, pairs + 1), 2
    episode.alarm[:], episode.step[0] = np.where(np.arange(vehicles) % 2, 1, -1), step
    episode.controller[:], episode.controller[:2] = SLIDING, HUMAN
    drawn: Any = SimpleNamespace(attacker=2, onset_step=5, reference_start_m=100.0, reference_speed_mps=10.0)
    rules: Any = SimpleNamespace(formation_weight_mps2=0.5, dt_s=0.1)
    score = records(Metrics, 1).view(np.recarray)[0]  # as plain Python needs it
    score.formation_cost_s = 8.0
    measure(episode, score, drawn, rules)
    assert (score.damage, score.damage_ahead) == (episode.damage.sum(), episode.damage[2:].sum())
    assert (score.collisions, score.alarms, score.attacked) == (2 * pairs, vehicles, attacked)
    assert (score.humans, score.formation_charge) == (2, 4.0)
    assert score.reference_error_m == pytest.approx(100.0 + step - episode.position[-1])


def test_only_where_nobody_knows_the_attacker_is_it_told_who_attacks() -> None:
    marked, hidden = (set(started(preset=preset).metrics()) for preset in ("paper", "learning"))
    assert hidden - marked == {"false_alarms", "attacked"}
    assert {"damage", "alarms", "humans", "reference_error_m"} <= marked <= hidden
