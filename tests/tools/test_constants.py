"""The constants that learners are compared with: all actions of an adapter."""

from __future__ import annotations

from cps_envs import PROBLEMS
from tests.episodes import spec_of
from tools.challenge.constants.adapters import constants_of, native_constants

PRESET = "learning"


def test_constants_are_all_actions_of_an_adapter() -> None:
    duel = PROBLEMS["fdi"].game(PROBLEMS["fdi"].presets[PRESET], 1)
    spec, sensors = duel.spec("attacker"), constants_of(duel.spec("defender"), "sensor")
    assert constants_of(spec, "motion") == [f"always?adapter=motion&action={level}" for level in range(9)]
    assert (len(sensors), sensors[1]) == (12, "always?adapter=sensor&action=[0,0,1]")
    assert constants_of(spec, "native") == native_constants(spec) == []
    house = spec_of(PROBLEMS["hvac"], "defender", PRESET)
    assert len(native_constants(house)) == house.action_space.n  # among them each set of believed sensors
