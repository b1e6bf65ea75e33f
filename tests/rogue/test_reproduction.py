"""The reproduction of chapter 5: its parts alone, and all of it against the specification's verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.rogue.config import PAPER
from cps_envs.rogue.controllers import FRONT, LINEAR, REAR
from cps_envs.rogue.problem import ROGUE
from cps_paper.chapter import Reproduction
from cps_paper.rogue import reference
from cps_paper.rogue.chapter import CHAPTER
from cps_paper.rogue.claims import CLAIMS
from cps_paper.rogue.course import RogueCourse
from cps_paper.rogue.experiments import (
    FULL_THROTTLE,
    Ride,
    RogueEvidence,
    Waves,
    calm_ride,
    map_rows,
    seat_overrides,
    square_ride,
    square_waves,
    swaying_ride,
)
from cps_paper.rogue.fit import FURTHER, ORDERINGS, OWN, fits, orderings
from cps_paper.rogue.heat_map import (
    COURSE_FREQUENCIES_HZ,
    FREQUENCIES_HZ,
    MAPS,
    RATIOS,
    SEAT_RATIOS,
    SEATS,
    SWAYS,
    HeatMap,
    bumper_gap_m,
    collision_frequency_hz,
)
from cps_paper.rogue.plots import edges_of
from cps_paper.rogue.rides import affected, followers, radii_m, shares_of_rings
from cps_paper.verdicts import NEAR, PARTLY, REPRODUCED, UNKNOWN, Check
from tests.reproduced import as_published

LINE = {  # specification 2, by gap in m
    4.5: (0.110, 0.158, 0.196, 0.227, 0.280, 0.325, 0.364),
    9.0: (0.075, 0.110, 0.136, 0.158, 0.196, 0.227, 0.255),
}
LINE_RATIOS = (1.1, 1.2, 1.3, 1.4, 1.6, 1.8, 2.0)


@pytest.mark.parametrize("gap_m", LINE)
def test_the_collision_line_is_the_specification_s(gap_m: float) -> None:
    found = [collision_frequency_hz(ratio, gap_m) for ratio in LINE_RATIOS]
    assert found == pytest.approx(LINE[gap_m], abs=6e-4)
    assert collision_frequency_hz(1.0, gap_m) == 0.0
    assert bumper_gap_m() == 4.5


def test_the_collision_line_is_where_integrated_vehicles_meet() -> None:
    ratio = 1.3

    def slope(_: float, state: Sequence[float]) -> tuple[float, ...]:
        _x, v, _y, w = state
        return v, ratio * 5 - 0.1 * v, w, 5 - 0.1 * w

    def contact(_: float, state: Sequence[float]) -> float:
        return state[2] - state[0] - 4.5

    contact.terminal = True
    met = solve_ivp(slope, (0, 60), [0.0, 25.0, 9.0, 25.0], events=contact, rtol=1e-9, atol=1e-9)
    assert collision_frequency_hz(ratio, 4.5) == pytest.approx(1 / (2 * met.t_events[0][0]), rel=1e-6)


def heat_map(
    damage: Any, frequencies_hz: Sequence[float] = (0.02, 0.05, 0.08, 0.11, 0.14), ratios: Sequence[float] = (1.0, 1.4)
) -> Any:
    return HeatMap(ratios, frequencies_hz, np.asarray(damage, float))


def test_a_heat_map_knows_its_peak_halves_and_windows() -> None:
    found = heat_map([[4, 2, 9, 1, 0], [8, 6, 9, 20, 0]])
    assert (found.highest, found.mean, found.peak) == (20, 5.9, (0.11, 1.4))
    assert found.low.tolist() == [3, 7]
    assert found.high.tolist() == [0.5, 10]
    assert found.last_harmful_hz == [0.11, 0.11]
    assert found.row(1.4).tolist() == [8, 6, 9, 20, 0]
    part = found.window(0.05, 1.0)
    assert (part.ratios, part.frequencies_hz) == ([1.0], [0.05, 0.08, 0.11, 0.14])
    assert part.damage.tolist() == [[2, 9, 1, 0]]
    assert edges_of((1.0, 1.1, 1.2)) == pytest.approx([0.95, 1.05, 1.15, 1.25])


def maps_with(**peaks: Any) -> Any:
    """Maps in which all eight orderings hold, with some maxima changed."""
    highest = {"pd": 100, "sliding": 90, "sliding_detection": 60, "disband_2": 80, "disband_4": 85, "disband_7": 62}
    rows = {name: [[30, 1, 1, 0, 0], [value, 1, 1, 0, 0]] for name, value in (highest | peaks).items()}
    rows["sliding_detection"][0] = [10, 0, 0, 0, 0]
    return {name: heat_map(row) for name, row in rows.items()}


@pytest.mark.parametrize(
    ("peaks", "broken"),
    [
        ({}, []),
        ({"pd": 59}, [3]),
        ({"sliding": 55}, [4]),
        ({"sliding_detection": 81}, [5]),
        ({"sliding_detection": 84}, [5, 6]),
        ({"disband_7": 82}, [6, 7]),
        ({"disband_7": 40}, [6]),
        ({"disband_4": 59}, [5, 7]),
    ],
)
def test_each_ordering_can_break(peaks: Any, broken: Any) -> None:
    hold = orderings(maps_with(**peaks))
    assert [k for k, each in enumerate(hold) if not each] == broken
    assert len(hold) == len(ORDERINGS)


def test_orderings_of_sums_and_of_halves_can_break() -> None:
    maps = maps_with()
    even = heat_map(np.ones((2, 5)))
    assert orderings({**maps, "pd": replace(even, damage=100 * even.damage)})[1] is False
    assert orderings({**maps, "sliding": replace(even, damage=100 * even.damage)})[2] is False
    assert orderings({**maps, "sliding_detection": heat_map([[20, 0, 0, 0, 0], [60, 0, 0, 0, 0]])})[0] is False


def test_variants_differ_and_use_the_paper_s_maps_where_they_can() -> None:
    own = {each for name in MAPS.values() for contact in ("pass", "solid") for each in map_rows(name, contact)}
    assert all(set(variant.experiments()) <= own for variant in OWN)
    assert not any(set(variant.experiments()) <= own for variant in FURTHER)
    assert len({variant.name for variant in (*OWN, *FURTHER)}) == len((*OWN, *FURTHER))


def make_course(damage: Any, human_from: Any = None) -> Any:
    count = len(damage)
    pairs = np.zeros((count, 4))
    pairs[:, 2] = damage
    x = np.tile(9.0 * np.arange(5), (count, 1))
    humans = np.zeros((count, 5), bool)
    if human_from is not None:
        humans[human_from:] = True
    return RogueCourse(
        config=PAPER,
        attacker=2,
        time_s=np.arange(count, dtype=float),
        position_m=x,
        speed_mps=np.zeros((count, 5)),
        acceleration_mps2=np.zeros((count, 5)),
        reference_m=36.0 + 25.0 * np.arange(count),
        growth_m=np.zeros((count, 5)),
        alarm=np.zeros((count, 5), int),
        human=humans,
        pair_damage=pairs,
    )


def test_a_course_knows_growth_disbanding_and_distance_to_the_reference() -> None:
    steady = make_course([0, 1, 2, 3, 4, 5, 6, 7, 8], human_from=5)
    assert steady.grows_throughout(4, 0.01)
    assert not make_course([0, 1, 2, 3, 4, 4, 4, 4, 4]).grows_throughout(4, 0.01)
    assert not make_course([0] * 9).grows_throughout(4, 0.01)
    assert (steady.disbanded_s, make_course([0, 1]).disbanded_s) == (5.0, None)
    assert steady.behind_m[2].tolist() == [50.0] * 5
    assert steady.intact == [0, 1, 3, 4]
    assert steady.final_damage == 8


def test_a_ride_is_the_same_episode_as_a_wave() -> None:
    ride = Ride("sliding", 1.3, duration_s=20.0, attacker="square?frequency_hz=0.1").run()
    together = Waves("sliding", 1.3, duration_s=20.0, waves=(*square_waves((0.05, 0.1)), FULL_THROTTLE)).run()
    assert ride.final_damage == together[1] > 0
    assert ride.time_s[-1] == pytest.approx(20.0)
    assert together[2] > together[1]


def test_claims_that_were_not_simulated_stay_open() -> None:
    findings = Reproduction(CHAPTER, ("claims",), RogueEvidence()).findings
    assert {finding.verdict for _, finding in (*findings["pass"], *findings["solid"])} == {UNKNOWN}


def test_recovery_is_judged_against_the_same_run_without_an_attack() -> None:
    calm = make_course([0] * 9)
    calm = replace(calm, speed_mps=np.full((9, 5), 25.0), reference_m=calm.reference_m - 25.0 * np.arange(9.0))
    speeds = calm.speed_mps.copy()
    speeds[2:5, 3] = 20.0
    slow = replace(calm, speed_mps=speeds, config=replace(PAPER, human_returns=True))
    results = {calm_ride("disband_2", "pass"): calm}
    for frequency_hz in COURSE_FREQUENCIES_HZ:
        for returns in (False, True):
            results[square_ride("disband_2", frequency_hz, "pass", human_returns=returns)] = slow

    def finding(changed: Any = slow) -> Any:
        results[square_ride("disband_2", COURSE_FREQUENCIES_HZ[0], "pass")] = changed
        return CLAIMS.evaluate(RogueEvidence(results), ["R07"])[0][1]

    assert finding().verdict == REPRODUCED
    assert "3 of 3 frequencies, after 5 / 5 / 5 s" in finding().shown
    away = slow.position_m.copy()
    away[-1, -1] -= 0.06 * PAPER.separation_m
    assert finding(replace(slow, position_m=away)).verdict == NEAR
    speeds = speeds.copy()
    speeds[-1, 4] = 22.0
    assert finding(replace(slow, speed_mps=speeds, position_m=away)).verdict == PARTLY


def test_references_have_tolerances_and_a_change_fails() -> None:
    every = reference.damages()
    assert len(every) == 24
    assert {each.defender for each in every if each.wave is None} == set(MAPS.values())
    cell = next(each for each in every if each.reference.value == 106.528)
    assert cell.reference.tolerance.amount == pytest.approx(1.07, abs=0.01)
    assert Check(cell.label, 107.5, cell.reference).passed
    assert not Check(cell.label, 107.7, cell.reference).passed
    results = {each.experiment: np.array([each.reference.value]) for each in every if each.experiment}
    found = Reproduction(CHAPTER, (), RogueEvidence({**results, cell.experiment: np.array([120.0])}))
    assert not found.passed
    failed = found.closing()
    assert "11 of 12" in failed[-1]
    assert "FAILED: linear bidirectional, pass, ratio 1.2, 0.1 Hz: 120 for 106.528" in failed[-1]


def test_maps_that_are_too_low_fail_the_reproduction() -> None:
    results = {}
    for contact in ("pass", "solid"):
        for name in MAPS.values():
            results |= {row: np.ones(len(FREQUENCIES_HZ)) for row in map_rows(name, contact)}
    results |= {each.experiment: np.array([each.reference.value]) for each in reference.damages() if each.experiment}
    found = Reproduction(CHAPTER, ["maps"], RogueEvidence(results))
    assert not found.passed
    assert sum(not each.passed for each in found.checks) == 12
    assert Reproduction(CHAPTER, ["5.3"], RogueEvidence(results)).passed


@pytest.mark.slow
def test_verdicts_are_the_published_ones() -> None:
    found = CHAPTER.reproduce(["maps", "claims"])
    assert found.passed
    as_published(found)
    for findings in found.findings.values():
        assert all("3 of 4 cells apply" in finding.shown for claim, finding in findings if claim.id == "R19")
    assert found.evidence.map("pd").peak == (FREQUENCIES_HZ[0], RATIOS[-1])
    text = " ".join(found.closing())
    for words in (
        "818 combinations",
        "27 of 1152",
        "not a robust property",
        "one corner cell",
        "24 of 24",
        "supports nothing",
    ):
        assert words in text


@pytest.mark.slow
def test_the_configuration_is_as_selected_as_the_specification_says() -> None:
    found = CHAPTER.reproduce(["fit"])
    hold = {variant.name: held for variant, _, held in fits(found.evidence)}
    highest = {
        variant.name: {name: each.highest for name, each in maps.items()} for variant, maps, _ in fits(found.evidence)
    }
    assert all(hold["as configured"])
    assert all(hold["F- = -0.5"])
    assert all(hold["n_3 = 0.25, ratios to 2"])
    for name in ("f from 0.05 Hz", "f from 0.11 Hz", "solid", "F- = 0", "n_3 = 0.25", "ratios to 2"):
        assert not all(hold[name]), name
    expected = {"F- = -0.5": (2061, 1705, 1315, 1930, 1755, 1349), "F- = 0": (1968, 1459, 1477, 1850, 1474, 1477)}
    for name, values in expected.items():
        assert list(highest[name].values()) == pytest.approx(values, rel=0.02), name
    assert highest["n_3 = 0.25"]["disband_7"] == pytest.approx(2449, rel=0.02)
    assert highest["ratios to 2"]["disband_4"] == pytest.approx(3080, rel=0.02)
    assert highest["ratios to 2"]["sliding_detection"] == pytest.approx(3087, rel=0.02)


def test_other_seats_are_other_maps_and_the_paper_s_seat_is_the_paper_s_map() -> None:
    assert seat_overrides(5, 3) == ()
    for num_vehicles, seats in SEATS.items():
        for seat in seats:
            (row, *_) = map_rows("pd", "solid", SEAT_RATIOS, seat_overrides(num_vehicles, seat))
            config = ROGUE.config("paper", dict(row.overrides))  # does not raise: the step is stable
            assert (config.num_vehicles, config.attacker_index) == (num_vehicles, seat)
    assert set(map_rows("pd", "pass", SEAT_RATIOS, seat_overrides(5, 3))) <= set(map_rows("pd", "pass"))
    assert all(seat < num_vehicles for num_vehicles, seats in SEATS.items() for seat in seats)
    assert set(SEATS[5]) == {1, 2, 3, 4}  # every seat but the leader's


def test_the_swaying_ride_is_the_preset() -> None:
    assert swaying_ride(*SWAYS[-1]).config == ROGUE.config("oscillation", {})


def test_reversing_the_sign_of_k_d_makes_the_platoon_sway_until_it_crashes() -> None:
    """(5.15) damps the kick of one second; with k_d of -3 the last vehicle swings wider, and there is a contact."""
    obedient, swaying = (swaying_ride(*each).run() for each in SWAYS[:2])
    gaps = [course.separation_m[:, 0] for course in (obedient, swaying)]
    early, late = (
        gap[course.at(10.0) : course.at(50.0)] for gap, course in zip(gaps, (obedient, swaying), strict=True)
    )
    assert obedient.final_damage == 0.0 < swaying.final_damage
    assert np.ptp(late) > 5 * np.ptp(early)
    speeds = swaying.speed_mps[:, 1] - swaying.speed_mps.mean()
    assert np.sum(np.diff(np.sign(speeds)) != 0) >= 6  # at least three periods: oscillation, not one push
    assert np.allclose(obedient.speed_mps[-1], 25.0, atol=1.0)


def test_the_attacker_drives_by_its_gains() -> None:
    """After the kick the effort is that of (5.15) with the given gains, from the sensors of a vehicle in the middle."""
    config = ROGUE.config("paper", {"duration_s": 6.0})
    seen: list[tuple[float, float]] = []

    def look(game: Any) -> None:
        x, v = game.state.position[0], game.state.speed[0]
        e = (x[3] - x[2] - 9.0) + (x[1] - x[2] + 9.0)
        wanted = 2.0 * e - 0.5 * ((v[3] - v[2]) + (v[1] - v[2]))
        seen.append((float(np.clip((wanted + 0.1 * v[2]) / 5.0, -1.0, 1.0)), float(game.state.held_effort[0, 2])))

    attacker = "gains?proportional=2&derivative=-0.5&kick_s=1"
    play_episodes(ROGUE, config, {"attacker": attacker, "defender": "pd"}, [0], on_step=look)
    efforts = [held for _, held in seen[1:]]
    assert efforts[:10] == pytest.approx([1.0] * 10)  # the kick
    asked = [wanted for wanted, _ in seen[10:-1]]
    assert efforts[10:] == pytest.approx(asked, abs=1e-4)  # decided from what was there before the step
    with pytest.raises(ConfigurationError, match="kick_s = -1"):
        ROGUE.match(config, 1, {"attacker": "gains?kick_s=-1"})


def test_linear_detection_is_linear_until_the_alarm_and_then_follows_its_side() -> None:
    config = ROGUE.config("paper", {"duration_s": 30.0, "contact": "solid", "power_ratio": 1.3})
    laws, alarms = [], []

    def look(game: Any) -> None:
        laws.append(game.state.controller[0].copy())
        alarms.append(game.state.alarm[0].copy())

    play_episodes(ROGUE, config, {"attacker": "square", "defender": "pd_detection"}, [0], on_step=look)
    intact = [0, 1, 3, 4]
    assert np.any(alarms[-1][intact] != 0)
    for law, alarm in zip(laws[1:], alarms[:-1], strict=True):  # the alarm that was there at the decision
        expected = np.select([alarm > 0, alarm < 0], [FRONT, REAR], LINEAR)
        assert law[intact].tolist() == expected[intact].tolist()


def circling(position_m: Sequence[float], speed_mps: Sequence[float]) -> Any:
    """A vehicle ahead of the attacker with these errors on its rear side, which it blames from the second moment on."""
    course = make_course([0] * len(position_m))
    places, speeds = course.position_m.copy(), course.speed_mps.copy()
    places[:, 3] = places[:, 2] + 9.0 + 1.0 - np.array(position_m)
    speeds[:, 3] = speeds[:, 2] - np.array(speed_mps)
    alarm, growth = course.alarm.copy(), course.growth_m.copy()
    alarm[1:, 3], growth[:, 3] = -1, 1.0
    return replace(course, position_m=places, speed_mps=speeds, alarm=alarm, growth_m=growth)


def test_errors_are_those_of_followers_to_their_grown_separation() -> None:
    course = circling([0.0, 0.5, 4.0, 6.0, 7.0, 20.0], [0.0, 0.0, 1.0, 0.0, 1.0, 0.0])
    (errors,) = followers(course)
    assert errors.vehicle == 3
    assert errors.position_m == pytest.approx([0.5, 4.0, 6.0, 7.0, 20.0])
    assert errors.speed_mps == pytest.approx([0.0, 1.0, 0.0, 1.0, 0.0])
    assert radii_m(PAPER) == pytest.approx([0.9, 4.5, 6.75, 9.0])
    assert shares_of_rings(errors, PAPER) == pytest.approx([0.2] * 5)


def test_the_authority_matters_only_where_the_actuator_can_tell() -> None:
    on_surface, near, far = (0.0, 0.0), (0.0, 0.003), (0.0, 1.0)
    (errors,) = followers(circling([0.0, *(e for e, _ in (on_surface, near, far))], [0.0, 0.0, 0.003, 1.0]))
    assert affected(errors, PAPER).tolist() == [False, True, False]  # s = 0 asks for nothing; s = 1 saturates all
