"""The policies made for preset `learning`: assignments, the informed defender, and attackers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

from cps_baselines.rogue.assignment import Assigned, laws_of
from cps_baselines.rogue.identify import Identify, contested, known, nearest_traces
from cps_baselines.rogue.informed import Informed, responses
from cps_baselines.rogue.monitor import (
    AHEAD,
    BEHIND,
    FAR_AHEAD,
    FAR_BEHIND,
    LEADER,
    NOBODY,
    Monitor,
    divide,
    division_of,
)
from cps_baselines.rogue.switching import Switching
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.types import Array
from cps_envs.rogue.controllers import CONTROLLERS
from cps_envs.rogue.game import RogueGame
from cps_envs.rogue.panels import RESPONDED_TO, RIVALS
from cps_envs.rogue.problem import ROGUE
from cps_envs.rogue.state import NEVER
from tests import episodes
from tests.episodes import noted

FIRST = 8_000  # of the seeds here; those of the searches begin at 40,000,000
LETTERS = {name[0]: number for number, name in enumerate(CONTROLLERS)}


spec_of = partial(episodes.spec_of, ROGUE, preset="learning")


def play(attacker: Any, defender: Any, count: int = 24, **rest: Any) -> dict[str, Array]:
    return episodes.play(ROGUE, attacker, defender, range(FIRST, FIRST + count), "learning", **rest)


def watched(see: Callable[[Any], Any], attacker: Any, defender: Any, count: int, **overrides: Any) -> list[Any]:
    return episodes.watched(ROGUE, see, attacker, defender, range(FIRST, FIRST + count), "learning", **overrides)


def orders_of(defender: str, attacker: str = "none", count: int = 16, **overrides: Any) -> tuple[Array, RogueGame]:
    """The laws in force (steps, B, n) and the game at its end."""
    found = watched(lambda game: (game.state.controller.copy(), game), attacker, defender, count, **overrides)
    return np.array([laws for laws, _ in found]), found[0][1]


@pytest.mark.parametrize(("pattern", "expected"), [("shll", "shll"), ("sl", "ssll"), ("f", "ffff"), ("srhlfs", "shls")])
def test_an_assignment_gives_each_vehicle_its_letter_or_stretches(pattern: str, expected: str) -> None:
    laws, _ = orders_of(f"assigned?laws={pattern}", count=1, num_vehicles=4, attacker_index=2, duration_s=1.0)
    assert laws[-1, 0].tolist() == [LETTERS[letter] for letter in expected]


def test_an_assignment_covers_platoons_of_every_drawn_size() -> None:
    laws, game = orders_of("assigned?laws=sl", count=40, duration_s=1.0, onset_s=1.0)
    for b in range(40):
        n = game.drawn["num_vehicles"][b]
        rear = -(-n // 2)  # half, rounded up
        assert laws[-1, b, :n].tolist() == [LETTERS["s"]] * rear + [LETTERS["l"]] * (n - rear)


def test_an_assignment_plays_the_marked_seat_too() -> None:
    policy = Assigned(ROGUE.game(ROGUE.config("easy", {}), 1).spec("defender"), "shll")
    assert policy.tables.shape == (5, 4, 2)


def test_capitals_are_modified_and_unknown_letters_are_refused() -> None:
    assert laws_of("fF", "laws").tolist() == [[2, 0], [2, 1]]
    with pytest.raises(ConfigurationError, match=r"laws = 'sx' .* s \(sliding\)"):
        laws_of("sx", "laws")
    with pytest.raises(ConfigurationError, match="5 of the letters"):
        Monitor(spec_of("defender"), apart="ss")
    with pytest.raises(ConfigurationError, match='orders="all"'):
        Monitor(ROGUE.game(ROGUE.config("easy", {}), 1).spec("defender"))


@pytest.mark.parametrize("suspect", [NOBODY, 0, 2, 4])
@pytest.mark.parametrize(("error", "rate", "danger"), [(5.0, 0.0, False), (5.0, -6.0, True), (-3.0, 2.0, True)])
def test_the_laws_around_a_suspect_are_those_of_the_division(
    suspect: int, error: float, rate: float, danger: bool
) -> None:
    laws = division_of("d", "sflhr", "rhlfs", near_m=0.0, horizon_s=1.0)
    fields = spec_of("defender", num_vehicles=6, attacker_index=(1, 5)).fields
    at, values, orders = fields.offsets.view(np.recarray)[0], np.zeros(fields.size), np.zeros(12, np.int64)
    values[at.gap_error : at.gap_error + 5], values[at.gap_rate : at.gap_rate + 5] = error, rate
    divide(laws, suspect, values, at, 6, orders)
    letters = "rhlfs" if danger else "sflhr"
    for i, law in enumerate(orders[::2]):
        place = FAR_BEHIND if i < suspect - 1 else BEHIND if i < suspect else AHEAD if i <= suspect + 1 else FAR_AHEAD
        wanted = "d" if suspect == NOBODY else letters[LEADER if i == 5 else place]
        if i not in (suspect, 5) or suspect == NOBODY:
            assert law == LETTERS[wanted]


def test_the_informed_defender_waits_for_the_onset_and_knows_the_seat() -> None:
    config = {"attack_share": 0.75, "onset_s": (5.0, 10.0), "duration_s": 15.0}
    laws, game = orders_of("informed?before=s&apart=fhlrs&evade=fhlrs", "always?action=0.2", 40, **config)
    for b in range(40):
        n, seat, onset = (int(game.drawn[name][b]) for name in ("num_vehicles", "attacker", "onset_step"))
        assert np.all(laws[1:50, b, :n] == LETTERS["s"])
        expected = list("f" * max(seat - 1, 0) + "h" * (seat > 0) + "?" + "l" + "r" * n)[:n]
        expected[-1] = "s"
        wanted = [LETTERS["s"]] * n if onset == NEVER else [LETTERS.get(letter, -1) for letter in expected]
        assert [law for law, i in zip(laws[-1, b, :n], range(n), strict=True) if i != seat] == [
            law for i, law in enumerate(wanted) if i != seat
        ]


def test_the_informed_defender_recognises_its_attackers_and_no_others() -> None:
    informed = Informed(spec_of("defender"))
    references = list(responses())
    assert references == [contestant.reference for contestant in RIVALS["attacker"]]
    spec = spec_of("attacker")
    for place, reference in enumerate(references):
        opponent = None if reference == "none" else resolve_policy(reference, spec)
        assert informed._row(opponent) == place
    assert informed._row(resolve_policy("square?frequency_hz=0.07", spec)) == len(references)


def test_the_informed_defender_can_be_late() -> None:
    in_time, late, never = (
        play("duty_square", f"informed?apart=sslll&delay_s={delay_s}", 12)["return"] for delay_s in (0, 4, 60)
    )
    front = play("duty_square", "assigned?laws=f", 12)["return"]
    assert np.array_equal(never, front)
    assert not np.array_equal(in_time, late)
    assert not np.array_equal(late, never)


def test_a_strike_is_full_effort_and_the_rest_is_the_linear_law() -> None:
    def look(game: RogueGame) -> tuple[Array, Array]:
        x, v = game.state.position, game.state.speed
        error = (x[:, 3] - x[:, 2] - 9) - (x[:, 2] - x[:, 1] - 9)
        return game.state.effort[:, 2].copy(), (error + 3 * (v[:, 3] - 2 * v[:, 2] + v[:, 1]) + 0.1 * v[:, 2]) / 5

    exact = {"drive_mps2": 5.0, "drag_per_s": 0.1, "power_ratio": 1.0, "onset_s": 2.0, "attack_share": 1.0}
    exact |= {"num_vehicles": 5, "attacker_index": 3, "range_noise_m": 0.0, "range_rate_noise_mps": 0.0}
    efforts, errors = zip(*watched(look, "strike?strike_s=2&period_s=10", "sliding", 2, **exact), strict=True)
    found, law = np.array(efforts)[1:], np.clip(np.array(errors)[:-1], -1, 1)
    assert np.all(found[20:40] == 1.0)
    assert found[41:119] == pytest.approx(law[41:119], abs=0.02)
    assert np.all(found[121:139] == 1.0)


def test_tuned_is_switching_with_its_weights_by_name() -> None:
    names = ("front_gap", "front_rate", "rear_gap", "rear_rate", "excess", "bias", "hysteresis")
    weights = known().weights[0]
    tuned = "tuned?" + "&".join(f"{name}={weight}" for name, weight in zip(names, weights, strict=True))
    one, two = (play(attacker, "sliding", 4)["return"] for attacker in (tuned, "contested?against=pd"))
    assert np.array_equal(one, two)
    with pytest.raises(ConfigurationError, match="searched against 'nobody'"):
        contested(spec_of("attacker"), "nobody")


def test_identify_probes_and_then_plays_the_response_to_the_nearest_trace() -> None:
    spec, attacked = spec_of("attacker", attack_share=1.0, onset_s=0.0), {"attack_share": 1.0, "onset_s": 0.0}
    identify, general = Identify(spec), Switching(spec, known().probe)
    found = noted(identify, lambda seen, actions, state: (actions[:, 0], state[2].copy()))
    probing = noted(general, lambda seen, actions, state: actions[:, 0])
    for attacker in (identify, general):
        play(attacker, "assigned?laws=f", 40, **attacked)
    played, rows = (np.array(part) for part in zip(*found, strict=True))
    probe = round(known().probe_s / 0.1)
    assert np.all(rows[:probe] == -1)
    assert np.all(rows[probe] >= 0)
    assert np.array_equal(rows[probe], rows[-1])  # it decides once
    names = np.array(known().against)
    assert np.mean(names[rows[-1]] == "assigned?laws=f") > 0.6  # of seven
    assert np.array_equal(played[:probe], probing[:probe])


def test_the_nearest_trace_is_the_one_at_the_least_distance() -> None:
    generator = np.random.default_rng(0)
    traces, centres = generator.normal(size=(20, 5)), generator.normal(size=(4, 5))
    expected = [int(np.argmin([np.linalg.norm(trace - centre) for centre in centres])) for trace in traces]
    assert nearest_traces(traces, centres).tolist() == expected


def test_what_is_known_covers_the_defenders_of_the_search() -> None:
    assert known().against == RESPONDED_TO


def test_a_response_is_better_against_its_defender_than_the_general_switching() -> None:
    for against in ("pd", "sliding", "monitor"):
        searched = play(f"contested?against={against}", against, 40)["return"].mean()
        assert searched > play("switching", against, 40)["return"].mean()
