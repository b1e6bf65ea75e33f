from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cps_envs.core.compute.generators import seeded
from cps_envs.core.declare.seeds import training_seed
from cps_envs.core.errors import ConfigurationError
from cps_envs.hvac.closed_loop import unheated
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.weather_files import read_epw, read_tmy3, shipped_weather

HOURS = 24 * 3


def epw(folder: Path, *, lines: dict[int, str] | None = None) -> Path:
    """A made-up file of three days; some lines, counted from 1, otherwise."""
    months = ",".join(str(month) for month in range(1, 13))
    heads = ["LOCATION,Nowhere,-,-,made up,0,0,0,0,0", "DESIGN CONDITIONS,0", "TYPICAL/EXTREME PERIODS,0",
             f"GROUND TEMPERATURES,2,.5,,,,{months},2,,,,{months.replace(',', '.5,')}",
             "HOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0",
             "COMMENTS 1,caf\xe9", "COMMENTS 2,", "DATA PERIODS,1,1,Data,Sunday, 1/ 1,1/ 3"]  # fmt: skip
    body = [
        f"1995,1,{k // 24 + 1},{k % 24 + 1},60,?,{k / 10},0,79,100100,0,1415,288,{k % 24 * 10},0" for k in range(HOURS)
    ]
    text = heads + body
    for line, other in (lines or {}).items():
        text[line - 1] = other
    (folder / "a.epw").write_text("\n".join(text), encoding="latin-1")
    return folder / "a.epw"


def tmy3(folder: Path, *, line_5: str = "") -> Path:
    rows = [f"01/{k // 24 + 1:02}/1997,{k % 24 + 1:02}:00,{k % 24 * 10},{k / 10}" for k in range(HOURS)]
    text = ['1,"NOWHERE",AK,-9.0,55,-160,7', "Date (MM/DD/YYYY),Time (HH:MM),GHI (W/m^2),Dry-bulb (C)", *rows]
    text[4] = line_5 or text[4]
    (folder / "a.csv").write_text("\n".join(text))
    return folder / "a.csv"


def test_a_year_of_weather_is_three_series(tmp_path: Path) -> None:
    for found in (read_epw(epw(tmp_path)), read_tmy3(tmy3(tmp_path))):
        assert found.outdoor_c.at(np.array([3600.0, 5400.0, 86_400.0]), "linear")[:, 0] == pytest.approx([0, 0.05, 2.3])
        assert found.sun_w_per_m2.at(np.array([0.0, 3599.0, 7200.0]), "hold")[:, 0].tolist() == [0, 0, 20]
    assert found.ground_c is None
    heat = found.heat_w((0.5, 2.0))
    assert heat.values[23].tolist() == [115.0, 460.0]


def test_the_year_that_ships_is_the_station_s() -> None:
    """The annual mean, and the coldest and the warmest hour of the file of station 703165."""
    year = shipped_weather()
    assert (len(year.values), year.step_s, year.begin_s) == (8760, 3600.0, 3600.0)
    assert year.values.mean() == pytest.approx(4.4207, abs=1e-4)
    assert (year.values.min(), year.values.max()) == (-10.6, 19.4)


def test_preset_weather_plays_days_of_it_in_a_house_that_stays_warm() -> None:
    config = HVAC.config("weather", {})
    assert not unheated(config)
    game, days = HVAC.game(config, 40), {}
    for name, first in (("judged", 0), ("trained", training_seed(3))):
        game.reset(np.ones(40, bool), seeded(range(first, first + 40)))
        days[name] = set((game.state.first * config.step_s // 86_400).astype(int).tolist())
        assert len(days[name]) > 25
    assert not {day // 7 for day in days["judged"]} & {day // 7 for day in days["trained"]}


def test_the_ground_goes_straight_between_the_middles_of_months(tmp_path: Path) -> None:
    ground = read_epw(epw(tmp_path)).ground_c
    assert ground is not None
    assert ground.values[[45, 0, 15], 0] == pytest.approx([2.0, 6.5, 1.0], abs=0.2)
    deeper = read_epw(epw(tmp_path), depth=1).ground_c
    assert deeper is not None
    assert deeper.values[45, 0] == pytest.approx(2.5, abs=0.1)
    assert read_epw(epw(tmp_path, lines={4: "GROUND TEMPERATURES,0"})).ground_c is None


def test_weather_is_a_configuration(tmp_path: Path) -> None:
    weather = read_epw(epw(tmp_path))
    config = HVAC.config("learning", {"outdoor_c": weather.outdoor_c, "ground_c": weather.ground_c,
                                      "internal_heat_w": weather.heat_w((0.1,) * 4),
                                      "series_split": "all"})  # fmt: skip
    assert config.outdoor_c == weather.outdoor_c


@pytest.mark.parametrize(
    ("line", "other", "said"),
    [
        (1, "DESIGN,", "is no EPW"),
        (4, "GROUND TEMPERATURES,2,.5,,,,1,2", "line 4: the ground temperature is missing"),
        (12, "1995,1,1,4,60,?,99.9,0,79,1,0,1,288,0,0", "line 12: the dry bulb is 99.9"),
        (12, "1995,1,1,4,60,?,1.0,0,79,1,0,1,288,9999,0", "line 12: the global horizontal radiation is 9999"),
        (12, "1995,1,1,4,60,?,warm,0,79,1,0,1,288,0,0", "line 12: the dry bulb is missing or no number"),
        (12, "1995,1,1,5,60,?,1,0,79,1,0,1,288,0,0", "line 12: hour 5 where 4 should follow"),
        (12, "1995", "line 12: the hour is missing"),
    ],
)
def test_broken_epw_files_are_refused(tmp_path: Path, line: int, other: str, said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        read_epw(epw(tmp_path, lines={line: other}))


def test_broken_tmy3_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="line 5: the dry bulb is -9900"):
        read_tmy3(tmy3(tmp_path, line_5="01/01/1997,03:00,0,-9900"))
    with pytest.raises(ConfigurationError, match="lacks the column 'Dry-bulb"):
        read_tmy3(epw(tmp_path))
    with pytest.raises(ConfigurationError, match="No such file"):
        read_tmy3(tmp_path / "none.csv")
    with pytest.raises(ConfigurationError, match="depth = 2"):
        read_epw(epw(tmp_path), depth=2)


def test_what_is_too_large_to_be_weather_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "year.epw"
    for text, said in (("," * 4_000_001, "has 4000001 cells"), ("a" * 200_000, "field larger than field limit")):
        path.write_text(text)
        with pytest.raises(ConfigurationError, match=said):
            read_epw(path)
