"""Algorithm 2: the condition, the kick-start and the pruning against statements that share no code with the kernel."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cps_baselines.fdi.action_form import ActionForm
from cps_baselines.fdi.branch_and_bound import AT_REST, PRINTED, SearchTables, find_injections, make_search
from cps_baselines.fdi.injection import view_of
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import FloatArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.problem import FDI
from cps_paper.fdi.interpretations import FIG_3_2

KINDS = ("x", "v", "xv")
BROAD = FdiConfig()
SMALL = replace(BROAD, max_range_injection_m=2.0, max_rate_injection_mps=0.75)  # 9 and 7 candidates
REST = np.zeros((1, 8))
binary = st.integers(-192, 192).map(lambda value: value / 64.0)  # sums of these are exact, so that ties are ties
states = st.lists(binary, min_size=8, max_size=8).map(np.array)


def commands(config: FdiConfig, e: FloatArray) -> list[float]:
    """(3.6) and (3.7), vehicle by vehicle; the last entry is the reference."""
    n, k_p, k_d = config.num_vehicles, config.proportional_gain, config.derivative_gain
    found = []
    for i in range(n):
        behind = (e[i - 1], e[n + i - 1]) if i else (0.0, 0.0)
        found.append(k_p * (e[i] - behind[0]) + k_d * (e[n + i] - behind[1]))
    return [*found, 0.0]


def rest_of(config: FdiConfig, vehicle: int, e: FloatArray, sign: float = -1.0) -> float:
    """What (3.39) holds beside the injection: u_i - u_{i+1} - e_x,i."""
    u = commands(config, e)
    return u[vehicle - 1] - u[vehicle] + sign * float(e[vehicle - 1])


def gains(config: FdiConfig, kind: str) -> list[float]:
    """k_a, twice as much where both sensors are attacked."""
    single = {"x": config.proportional_gain, "v": config.derivative_gain}
    return [len(kind) * single[sensor] for sensor in kind]


def accepts(config: FdiConfig, vehicle: int, kind: str, e: FloatArray, injection: tuple[float, ...]) -> bool:
    """Whether (3.39), or (3.40) and (3.41), and the sensor's bounds hold."""
    speed = e[config.num_vehicles + vehicle - 1]
    for gain, sensor, d in zip(gains(config, kind), kind, injection, strict=True):
        push = gain * d + rest_of(config, vehicle, e)
        if speed == 0.0 and not push < 0.0:
            return False
        if speed * push > 0.0:
            return False
        if sensor == "x" and config.limit_readings and e[vehicle - 1] + d + config.desired_gap_m < 0.0:
            return False
    return True


def brute_force(config: FdiConfig, vehicle: int, kind: str, e: FloatArray, steps: int) -> float:
    """The cost of the cheapest legal sequence among all of them; inf where there is none."""
    grids = {
        "x": (config.range_levels, config.range_resolution_m),
        "v": (config.rate_levels, config.rate_resolution_mps),
    }
    axes = [np.arange(-grids[sensor][0], grids[sensor][0] + 1) * grids[sensor][1] for sensor in kind]
    candidates = list(itertools.product(*axes))
    columns = [{"x": 0, "v": config.num_vehicles}[sensor] + vehicle - 1 for sensor in kind]
    best = math.inf
    open_nodes = [(0.0, e, 0)]
    while open_nodes:
        cost, error, step = open_nodes.pop()
        if step == steps:
            best = min(best, cost)
            continue
        for candidate in candidates:
            if accepts(config, vehicle, kind, error, candidate):
                after = config.model.transition @ error + config.model.injection[:, columns] @ np.array(candidate)
                open_nodes.append((cost + sum(d * d for d in candidate), after, step + 1))
    return best


def smallest(low: float, high: float, bound: int, resolution: float) -> int | None:
    """The level of least size in [low, high], negative before positive; None where there is none."""
    levels = [z for z in range(-bound, bound + 1) if low <= z * resolution <= high]
    return min(levels, key=lambda z: (abs(z), z), default=None)


def closed_form(config: FdiConfig, vehicle: int, kind: str, e: FloatArray) -> list[int | None]:
    """N_h = 0: e_v > 0 asks for d <= -r / c, e_v < 0 for d >= -r / c, e_v = 0 for d < -r / c."""
    speed = e[config.num_vehicles + vehicle - 1]
    levels = []
    for gain, sensor in zip(gains(config, kind), kind, strict=True):
        edge = -rest_of(config, vehicle, e) / gain
        high = edge if speed > 0 else np.nextafter(edge, -np.inf) if speed == 0 else np.inf
        low = edge if speed < 0 else -np.inf
        if sensor == "x":
            low = max(low, -config.desired_gap_m - e[vehicle - 1])
            levels.append(smallest(low, high, config.range_levels, config.range_resolution_m))
        else:
            levels.append(smallest(low, high, config.rate_levels, config.rate_resolution_mps))
    return levels


@given(e=states, vehicle=st.integers(1, 4), kind=st.sampled_from(KINDS))
def test_one_step_is_the_closed_form(e: FloatArray, vehicle: int, kind: str) -> None:
    found = find_injections(make_search(BROAD, vehicle, kind), e[np.newaxis])
    expected = closed_form(BROAD, vehicle, kind, e)
    if None in expected:
        assert not found.found[0]
        assert not found.levels.any()
        assert found.costs[0] == np.inf
    else:
        assert found.found[0]
        assert found.levels[0, 0].tolist() == expected


@given(e=states, vehicle=st.integers(1, 4), kind=st.sampled_from(KINDS))
def test_what_is_found_satisfies_the_condition_at_every_step(e: FloatArray, vehicle: int, kind: str) -> None:
    search = make_search(BROAD, vehicle, kind, 1)
    found = find_injections(search, e[np.newaxis])
    if not found.found[0]:
        return
    resolution = [{"x": 0.5, "v": 0.25}[sensor] for sensor in kind]
    for levels in found.levels[0]:
        d = levels * resolution
        for gain, push in zip(gains(BROAD, kind), d, strict=True):
            condition = e[4 + vehicle - 1] * (gain * push + rest_of(BROAD, vehicle, e))
            assert condition <= 1e-9
        e = search.transition @ e + search.effect @ d


@given(e=states, kind=st.sampled_from(KINDS))
def test_pruning_loses_nothing(e: FloatArray, kind: str) -> None:
    found = find_injections(make_search(SMALL, 3, kind, 1), e[np.newaxis])
    assert found.costs[0] == pytest.approx(brute_force(SMALL, 3, kind, e, 2))


@pytest.mark.parametrize(("kind", "steps_ahead"), [("x", 2), ("v", 2)])
def test_three_steps_against_all_sequences(kind: str, steps_ahead: int) -> None:
    for e in np.random.default_rng(0).uniform(-1.0, 1.0, (20, 8)):
        found = find_injections(make_search(SMALL, 2, kind, steps_ahead), e[np.newaxis])
        assert found.costs[0] == pytest.approx(brute_force(SMALL, 2, kind, e, steps_ahead + 1))


@given(e=states, kind=st.sampled_from(KINDS), width=st.integers(1, 4))
def test_a_width_limit_is_never_cheaper(e: FloatArray, kind: str, width: int) -> None:
    exact = find_injections(make_search(SMALL, 3, kind, 1), e[np.newaxis])
    narrow = find_injections(make_search(SMALL, 3, kind, 1, width=width), e[np.newaxis])
    assert narrow.costs[0] >= exact.costs[0]
    assert exact.found[0] or not narrow.found[0]


def test_a_width_limit_is_a_heuristic() -> None:
    errors = np.random.default_rng(1).uniform(-3.0, 3.0, (2000, 8))
    exact = find_injections(make_search(SMALL, 3, "x", 2), errors)
    narrow = find_injections(make_search(SMALL, 3, "x", 2, width=1), errors)
    assert (narrow.costs > exact.costs).any()
    assert narrow.nodes.sum() < exact.nodes.sum()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("zero", [0.0, -0.0])
def test_kick_start_at_rest_injects_the_smallest_negative_value(kind: str, zero: float) -> None:
    found = find_injections(make_search(BROAD, 4, kind), np.full((1, 8), zero))
    assert found.levels[0, 0].tolist() == [-1] * len(kind)


def test_kick_start_follows_the_sign_of_the_numerator() -> None:
    with np.errstate(all="ignore"):
        h_2 = -(np.array([-0.5, 0.0, 0.5]) * BROAD.proportional_gain) / np.float64(0.0)
    assert h_2[0] == np.inf
    assert np.isnan(h_2[1])
    assert h_2[2] == -np.inf
    search = make_search(replace(BROAD, attacked="v4", max_range_injection_m=0.4), 4, "x")  # 0 is the only candidate
    assert not find_injections(search, REST).found[0]


def test_a_platoon_that_is_nearly_at_rest_is_at_rest() -> None:
    game = FDI.game(BROAD, 1)
    game.reset(np.ones(1, np.bool_), [np.random.default_rng(0)])
    game.state.error[0] = AT_REST / 2
    game.state.error[0, -1] = 200 * AT_REST
    seen = Seen(game.fields["attacker"], game.observe("attacker"))
    assert seen["gap_error"].any()
    (error,) = view_of(ActionForm(BROAD), seen).error
    np.testing.assert_array_equal(error[:-1], REST[0, :-1])
    assert error[-1] == pytest.approx(200 * AT_REST, rel=1e-2)


def test_spoofed_range_is_bounded_where_readings_are() -> None:
    e = np.array([[0.0, 0.0, 0.0, -4.8, 0.0, 0.0, 0.0, 0.1]])
    free = make_search(replace(BROAD, limit_readings=False), 4, "x")
    bounded = make_search(BROAD, 4, "x")
    assert find_injections(free, e).found[0]
    push = find_injections(free, e).levels[0, 0, 0] * 0.5
    assert find_injections(bounded, e).found[0] == (e[0, 3] + push >= -5.0)
    down = np.array([[0.0, 0.0, 0.0, -4.8, 0.0, 0.0, -1.0, 0.1]])
    assert find_injections(free, down).levels[0, 0, 0] * 0.5 < -0.2
    assert not find_injections(bounded, down).found[0]


def test_the_printed_sign_is_another_condition() -> None:
    e = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.5])
    for sign, options in ((-1.0, {}), (1.0, {"gap_sign": PRINTED})):
        level = find_injections(make_search(BROAD, 4, "x", **options), e[np.newaxis]).levels[0, 0, 0]
        edge = -rest_of(BROAD, 4, e, sign) / BROAD.proportional_gain
        assert level == math.floor(edge / 0.5)


def test_environments_do_not_disturb_one_another() -> None:
    errors = np.random.default_rng(2).uniform(-2.0, 2.0, (50, 8))
    search = make_search(BROAD, 2, "xv", 1)
    together = find_injections(search, errors)
    for b in range(len(errors)):
        alone = find_injections(search, errors[b : b + 1])
        for ours, theirs in zip(alone, together, strict=True):
            np.testing.assert_array_equal(ours[0], theirs[b])


def test_the_lead_has_a_reference_ahead_that_commands_nothing() -> None:
    search: SearchTables = make_search(FIG_3_2, 10, "x")
    assert not search.ahead.any()
    assert search.levels.shape == (1, 201)
    assert make_search(FIG_3_2, 10, "xv").moves.shape == (201 * 161, 2)


@pytest.mark.parametrize("wrong", [(5, "x", 0), (0, "x", 0), (1, "y", 0), (1, "x", -1)])
def test_wrong_input_is_refused(wrong: tuple[int, str, int]) -> None:
    with pytest.raises(ConfigurationError, match="vehicle from 1 to 4"):
        make_search(BROAD, *wrong)
