"""What the chapter simulates."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from cps_paper.evidence import Experiment
from cps_paper.hvac.scenario import DayScenario, RecordedDay

Case = tuple[tuple[int, ...], int]  # sensors, N_e
ATTACKS = ("constant", "sine", "random")
DEFENCES = ("none", "mtd1", "mtd2")
MODEL_FALLBACK = "mtd2?fallback=model"
LEAST_MEAN = "mtd2"
DAYS = {4: 60, 8: 40}  # by number of sensors
FIGURE_4_5_DAYS = 20
FIGURE_4_6_DAYS = 10
TABLE_DAYS = {"4.1": 10, "4.2": 100}
ENERGIES_W = (1000.0, 500.0, 100.0)  # Fig. 4.3
OBSERVERS: tuple[Case, ...] = (((2,), 200), ((2,), 100), ((2, 3), 100), ((2, 3, 4), 30))  # Fig. 4.5
TABLE_SENSORS = ((2,), (2, 3), (2, 3, 4), (1, 2, 3, 4))  # of one to four; the paper does not name them
PERCENTS = {"4.1": (20, 40, 60, 80), "4.2": (2, 5, 10, 30)}
EARLY = (*((0, attacker) for attacker in ATTACKS), (100, "constant"))  # onset step, attack
EARLY_COUNTS = (1, 2, 3)


def scenario(attacker: str, defender: str, days: int, **settings: Hashable) -> DayScenario:
    """A scenario whose configuration differs from the preset `paper` in these fields."""
    return DayScenario(attacker, defender, days, tuple(sorted(settings.items())))


def recorded(attacker: str, defender: str, days: int, **settings: Hashable) -> RecordedDay:
    """The same with its course."""
    return RecordedDay(attacker, defender, days, tuple(sorted(settings.items())))


def compared(num_sensors: int, attacker: str, defender: str, count: int) -> DayScenario:
    """A bar of Fig. 4.7 or 4.8; a count of 0 is the attack-free day, whoever the attacker would be."""
    if count == 0:
        return scenario("none", defender, DAYS[num_sensors], num_sensors=num_sensors)
    return scenario(attacker, defender, DAYS[num_sensors], num_sensors=num_sensors, num_compromised=count)


def undefended(attacker: str, count: int) -> DayScenario:
    """A bar of Fig. 4.4a, whose sensors fall in the order 1, 2, 3, 4."""
    if count == 0:
        return compared(4, attacker, "none", 0)
    return scenario(attacker, "none", DAYS[4], num_compromised=count, attack_order=(1, 2, 3, 4))


def noise_free(max_heating_w: float) -> RecordedDay:
    """The attack-free day of Figs. 4.2 and 4.3."""
    return recorded("none", "none", 1, noise_std_c=0.0, max_heating_w=max_heating_w)


def first_zone(attacker: str) -> RecordedDay:
    """Figs. 4.4b, c: sensor 1 alone is attacked; with the attacker "none", the same days without an attack."""
    return recorded(attacker, "none", DAYS[4], num_compromised=1, attack_order=(1, 2, 3, 4))


def observed(sensors: tuple[int, ...], window_steps: int) -> RecordedDay:
    """A case of Fig. 4.5."""
    settings: dict[str, Hashable] = {"window_steps": window_steps, "sensor_sets": (*sensors, 0, 1, 2, 3, 4)}
    return recorded("none", _fixed(sensors), FIGURE_4_5_DAYS, **settings)


def second_zone() -> RecordedDay:
    """Fig. 4.6: MTD1 while sensor 2 shows a negative bias."""
    return recorded("constant", "mtd1", FIGURE_4_6_DAYS, num_compromised=1)


def first_two(attacker: str) -> RecordedDay:
    """MTD1 while two of four sensors are attacked, s1 and s2: its course behind Figs. 4.7a to c."""
    return recorded(attacker, "mtd1", FIGURE_4_6_DAYS, num_compromised=2, attack_order=(1, 2, 3, 4))


def table_cell(table: str, percent: int, sensors_used: int) -> DayScenario:
    """A row of Table 4.1 or 4.2; 0 sensors: the measurements themselves."""
    settings: dict[str, Hashable] = {"sensor_sets": (2, 0, 2, 3, 0, 2, 3, 4, 0, 1, 2, 3, 4)}  # TABLE_SENSORS
    if table == "4.1":
        settings["noise_std_c"] = (percent / 100.0) ** 0.5
    else:
        settings |= {"noise_std_c": 0.0, "model_error": percent / 100.0}
    defender = _fixed(TABLE_SENSORS[sensors_used - 1]) if sensors_used else "none"
    return scenario("none", defender, TABLE_DAYS[table], **settings)


def early(onset_step: int, attacker: str, count: int) -> DayScenario:
    """MTD2 against an attack that starts before the observer's window is full; not in the paper."""
    return scenario(attacker, LEAST_MEAN, DAYS[4], num_compromised=count, onset_step=onset_step)


def table_cells(table: str) -> list[Experiment[Any]]:
    """Everything behind Table 4.1 or 4.2."""
    return [table_cell(table, percent, used) for percent in PERCENTS[table] for used in range(len(TABLE_SENSORS) + 1)]


def bars(num_sensors: int) -> list[Experiment[Any]]:
    """Everything behind Fig. 4.7 (4 sensors) or 4.8 (8)."""
    counts = range(num_sensors + 1)
    every = [compared(num_sensors, a, defender, count) for a in ATTACKS for defender in DEFENCES for count in counts]
    return [*every, *(compared(num_sensors, attacker, MODEL_FALLBACK, num_sensors) for attacker in ATTACKS)]


def early_onsets() -> list[Experiment[Any]]:
    """All early attacks."""
    return [early(onset, attacker, count) for onset, attacker in EARLY for count in EARLY_COUNTS]


def figure(name: str) -> list[Experiment[Any]]:
    """Everything behind a figure, "4.2fig" to "4.8fig"."""
    if name == "4.7fig":
        return [*bars(4), *map(first_two, ATTACKS)]
    if name == "4.8fig":
        return bars(8)
    if name == "4.4fig":
        counts = [undefended(attacker, count) for attacker in ATTACKS for count in range(5)]
        return [*counts, first_zone("constant"), first_zone("none")]
    behind: dict[str, list[Experiment[Any]]] = {
        "4.2fig": [noise_free(ENERGIES_W[0])],
        "4.3fig": [noise_free(energy_w) for energy_w in ENERGIES_W],
        "4.5fig": [observed(*case) for case in OBSERVERS],
        "4.6fig": [second_zone()],
    }
    return behind[name]


def _fixed(sensors: tuple[int, ...]) -> str:
    """The defender that always uses these sensors."""
    return f"fixed?sensors=[{','.join(map(str, sensors))}]"
