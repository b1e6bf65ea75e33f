from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from cps_envs.core.picture.history import History
from cps_envs.core.picture.palette import BELIEVED, FALSE
from cps_envs.core.picture.plot import Plot
from cps_envs.core.picture.vehicle import VEHICLE_M
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.picture.beliefs import belief_color, beliefs_of, free_rows
from cps_envs.fdi.picture.outcome import certificate_of, outcome_of, task_of
from cps_envs.fdi.picture.road import lay_out
from cps_envs.fdi.picture.scene import Scene
from cps_envs.fdi.picture.viewer import FdiViewer, panels, with_illegal_readings
from cps_paper.fdi.interpretations import CLIP, FIG_3_2
from tests.fdi.pictures import COLLISION, CONFIG, CRASH, EVERY, START, UNDER_WAY, frame, inject, opened, played

DEFENDED = replace(CLIP, attacked="x1,4+v2")
ROAD = (0.0, 0.0, 900.0, 118.0)

pygame = pytest.importorskip("pygame")


def test_what_was_used_instead_is_visible() -> None:
    replaced = replace(UNDER_WAY, trusted=np.arange(8) != 3)
    elsewhere = replace(replaced, used_gap=replaced.used_gap + 2)
    assert not np.array_equal(frame(replaced), frame(elsewhere))


def test_collision_is_named_and_marked() -> None:
    assert COLLISION.metrics["collided_target"] == 1
    assert outcome_of(COLLISION) == f"Collision: 4 hits reference at {COLLISION.closing_speed[3]:.2f} m/s"
    unmarked = replace(COLLISION, metrics=COLLISION.metrics | {"collided_pairs": 0, "collided_target": 0})
    road = np.s_[150:200]
    assert not np.array_equal(frame(COLLISION)[road], frame(unmarked)[road])


def test_of_many_collisions_the_fastest_are_named() -> None:
    scene = replace(COLLISION, gap=-np.ones(4), closing_speed=np.array([1.0, 4.0, 2.0, 3.0]))
    expected = "Collision: 2 hits 3 at 4.00 m/s, 4 hits reference at 3.00 m/s, and 2 more pairs"
    assert outcome_of(scene) == expected


def test_illegal_command_is_named_and_its_reading_shown() -> None:
    scene = played(CONFIG, [-8, -8, 70])
    assert scene.metrics["illegal"] == 1
    assert outcome_of(scene).startswith("Illegal: vehicle 4 would have to command 3")
    np.testing.assert_allclose(with_illegal_readings(scene).reported_gap[3], scene.gap[3] + 35.0)
    assert frame(scene).shape == (540, 960, 3)


def test_illegal_reading_is_named() -> None:
    config = replace(CONFIG, limit_commands=False)
    scene = with_illegal_readings(played(config, [-12]))
    assert outcome_of(scene) == "Illegal: range below 0 m reported by 4"


def test_time_that_is_up_is_said() -> None:
    assert outcome_of(UNDER_WAY) == ""
    assert outcome_of(played(CONFIG, [0] * CONFIG.horizon)) == "No collision in time"


def test_task_in_words() -> None:
    assert task_of(START) == "4 vehicles, falsified range of 4; 4 is to hit its reference"
    other = played(replace(CONFIG, attacked="x1,3+v2", target=1), [])
    assert task_of(other) == "4 vehicles, falsified range of 1, 3 and range-rate of 2; 1 is to hit 2"


@pytest.mark.parametrize(
    ("bound", "value", "valid", "text"),
    [
        (np.inf, 0.0, 0.0, "nothing certified for this task"),
        (np.inf, 6.5, 0.0, "6.50 known to be possible"),
        (6.6, 6.5, 1.0, "certified 6.50 to 6.60"),
        (6.6, 6.6, 1.0, "certified optimum 6.60"),
        (0.0, 0.0, 1.0, "certified to be unreachable"),
        (6.6, 6.5, 0.0, "certified 6.60 does not apply here"),
    ],
)
def test_certificate_in_words(bound: float, value: float, valid: float, text: str) -> None:
    metrics = START.metrics | {"oracle_bound_mps": bound, "oracle_value_mps": value, "bound_valid": valid}
    assert certificate_of(replace(START, metrics=metrics)) == text


def test_readings_out_of_this_world() -> None:
    for gap in (-1000.0, -3.0, 0.0, 1000.0):
        scene = replace(UNDER_WAY, used_gap=np.full(4, gap), reported_gap=np.full(4, gap), gap=np.full(4, -gap))
        assert frame(scene).shape == (540, 960, 3)


def test_gaps_are_drawn_to_scale_between_bumpers() -> None:
    road = lay_out(UNDER_WAY, ROAD)
    gaps = [(road.ahead(i) - road.front[i]) / road.scale for i in range(4)]
    np.testing.assert_allclose(gaps, UNDER_WAY.gap, atol=1 / road.scale)
    assert road.car[0] == round(VEHICLE_M * road.scale)


def test_reference_stays_and_a_long_platoon_fits() -> None:
    assert lay_out(START, ROAD).reference == lay_out(UNDER_WAY, ROAD).reference
    stretched = lay_out(replace(START, gap=np.full(4, 40.0)), ROAD)
    assert stretched.scale < lay_out(START, ROAD).scale
    assert stretched.front[0] - stretched.car[0] > 0


def test_ghosts_stand_where_falsified_ranges_put_the_vehicle_ahead() -> None:
    road = lay_out(UNDER_WAY, ROAD)
    (belief,) = beliefs_of(UNDER_WAY, road.front.tolist(), road.scale)
    assert belief.ghost
    assert belief.begin == road.front[3]
    np.testing.assert_allclose((belief.end - belief.begin) / road.scale, UNDER_WAY.reported_gap[3])
    assert belief.label == f"{UNDER_WAY.reported_gap[3]:.1f} m"
    assert beliefs_of(START, road.front.tolist(), road.scale) == []


def test_beliefs_tell_falsified_from_replaced_readings() -> None:
    scene = played(DEFENDED, [4, 8], replaced=(0, 2))
    colors = [belief_color(scene, vehicle) for vehicle in range(4)]
    assert colors == [BELIEVED, FALSE, BELIEVED, FALSE]
    road = lay_out(scene, ROAD)
    labels = [belief.label for belief in beliefs_of(scene, road.front.tolist(), road.scale)]
    assert labels[0] == f"{scene.used_gap[0]:.1f} m"
    assert labels[1] == f"{scene.reported_closing_speed[1]:+.1f} m/s"


def test_what_is_used_is_the_reading_unless_it_is_replaced() -> None:
    scene = played(DEFENDED, [4, 8], replaced=(0,))
    np.testing.assert_array_equal(scene.used_gap[1:], scene.reported_gap[1:])
    np.testing.assert_array_equal(scene.used_closing_speed, scene.reported_closing_speed)
    assert abs(scene.used_gap[0] - scene.reported_gap[0]) > 3


def test_free_rows_never_overlap() -> None:
    assert free_rows([(0, 10), (20, 30), (5, 25), (40, 50), (26, 60)]) == [0, 0, 1, 0, 2]
    assert free_rows([]) == []


def remembering() -> History:
    return History(FdiViewer.moment, FdiViewer.kept, FdiViewer.most_points)


def recorded(game: FdiGame, history: History, levels: Sequence[int], draw: Callable[[int], bool]) -> Scene:
    scene = game.scene(0)
    for step, level in enumerate(levels):
        if draw(step):
            history.add(with_illegal_readings(scene))
        scene = inject(game, level)
    history.add(with_illegal_readings(scene))
    return scene


def test_history_keeps_truth_and_readings_at_their_own_times() -> None:
    game, history = opened(CONFIG), remembering()
    scenes = [game.scene(0)]
    history.add(with_illegal_readings(scenes[0]))
    for level in CRASH[:5]:
        scenes.append(inject(game, level))
        history.add(with_illegal_readings(scenes[-1]))
    curves = history.curves()
    gap, injection = curves["gap"][:, 3], curves["injection"][:, 3]
    np.testing.assert_allclose(curves["time_s"], 0.2 * np.arange(6))
    np.testing.assert_allclose(curves["sensed_s"][1:], curves["time_s"][:-1], atol=1e-12)
    np.testing.assert_array_equal(gap, [scene.gap[3] for scene in scenes])
    np.testing.assert_allclose(curves["reported_gap"][1:, 3], gap[:-1] + injection[1:], atol=1e-12)
    np.testing.assert_array_equal(injection[1:], 0.5 * np.array(CRASH[:5]))
    assert curves["trusted"].all()


def test_history_begins_anew_with_an_episode_or_when_time_goes_back() -> None:
    game, history = opened(CONFIG), remembering()
    recorded(game, history, CRASH[:4], lambda step: True)
    assert len(history.every()["gap"]) == 5
    game.reset(EVERY, [np.random.default_rng(0)])
    scene = recorded(game, history, CRASH[:6], lambda step: step > 4)
    np.testing.assert_allclose(history.curves()["time_s"], [1.0, 1.2])
    history.add(with_illegal_readings(replace(scene, time_s=0.4)))
    np.testing.assert_allclose(history.curves()["time_s"], [0.4])
    assert history.every()["gap"].max() == scene.gap.max()


def test_history_takes_a_moment_once_and_keeps_what_preceded_an_illegal_injection() -> None:
    game, history = opened(CONFIG), remembering()
    scene = recorded(game, history, [-8, -8], lambda step: True)
    history.add(with_illegal_readings(scene))
    assert len(history.every()["gap"]) == 3
    history.add(with_illegal_readings(inject(game, 70)))
    curves = history.curves()
    np.testing.assert_array_equal(curves["injection"][:, 3], [0.0, -4.0, -4.0, 35.0])
    np.testing.assert_allclose(curves["sensed_s"], [0.0, 0.0, 0.2, 0.4])


def test_environments_and_episodes_are_told_apart() -> None:
    game = FdiGame(CONFIG, 3)
    seen = []
    for _ in range(3):
        game.reset(np.ones(3, np.bool_), [np.random.default_rng(0)] * 3)
        seen += [game.scene(b).episode for b in range(3)]
    assert len(set(seen)) == 9


def shown(scene: Scene) -> list[Plot]:
    history = remembering()
    history.add(with_illegal_readings(scene))
    return [panel.plot for panel in panels(scene, history)]


def test_axes_hold_what_happened_and_both_columns_share_them() -> None:
    gap, speed, command, gaps, speeds, injection = shown(replace(UNDER_WAY, gap=np.array([5.0, 31.0, 5.0, 5.0])))
    assert (gap.low, gap.high) == (gaps.low, gaps.high)
    assert (speed.low, speed.high) == (speeds.low, speeds.high)
    assert gap.shows(31.0)
    assert command.shows(CONFIG.min_acceleration_mps2)
    assert injection.shows(float(UNDER_WAY.injection[3]))


def test_unlimited_commands_widen_their_axis() -> None:
    command = shown(replace(START, command=np.array([0.0, -30.0, 0.0, 12.0]), config=FIG_3_2))[2]
    assert command.shows(-30.0)
    assert command.shows(12.0)
