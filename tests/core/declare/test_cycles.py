from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cps_envs
from cps_envs.core.declare.cycles import SHIPPED, shipped_cycle
from cps_envs.core.errors import ConfigurationError

FCD = """<?xml version="1.0" encoding="UTF-8"?>
<fcd-export>
  <timestep time="0.00"><vehicle id="lead" x="1" y="2" speed="10.50" lane="a_0"/></timestep>
  <timestep time="0.50"><vehicle id="lead" speed="11.00"/><vehicle id="truck" speed="3"/></timestep>
  <timestep time="1.00"><vehicle id="truck" speed="4.5"/><vehicle id="lead" speed="12"/></timestep>
</fcd-export>
"""


def written(folder: Path, text: str, name: str = "cycle.csv") -> Path:
    path = folder / name
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("head", "unit", "factor"),
    [
        ("time_s,speed_mps", "", 1.0),
        ("time,speed_kmh", "", 1 / 3.6),
        ("time,Speed [km/h]", "", 1 / 3.6),
        ("cycSecs,cycMps", "", 1.0),
        ("time,speed_mph", "mph", 0.44704),
        ("time,speed", "km/h", 1 / 3.6),
        ("seconds,velocity (m/s)", "", 1.0),
    ],
)
def test_cycles_in_any_unit(tmp_path: Path, head: str, unit: str, factor: float) -> None:
    path = written(tmp_path, f"# EPA\n{head}\n0,0\n1,36\n2,18\n")
    cycle = cps_envs.read_drive_cycle(path, unit)
    assert cycle.values[:, 0] == pytest.approx(factor * np.array([0, 36, 18]))
    assert (cycle.step_s, cycle.begin_s, cycle.place(1)) == (1.0, 0.0, "line 4 of cycle.csv")


@pytest.mark.parametrize(
    ("text", "unit", "said"),
    [
        ("time,speed\n0,1\n1,2\n", "", "does not say the unit of its column 'speed'"),
        ("time,speed_mph\n0,1\n1,2\n", "km/h", "speeds in mph, but unit = 'km/h'"),
        ("time,speed\n0,1\n1,2\n", "knots", "none of speed"),
        ("speed,gear\n0,1\n1,2\n", "mph", "no column of times in s: name it 'time_s'"),
        ("time,gear\n0,1\n1,2\n", "", "no column of speeds.*it has 'time', 'gear'"),
        ("t,speed_mph\n0,1\n1,-2\n", "", "line 3: nobody drives at -0.89408 m/s"),
        ("t,speed_mph\n0,1\n1,\n", "", "line 3, column 'speed_mph': is empty"),
        ("t,speed_mph\n0,1\n1,2\n2,2\n4,4\n", "", "line 5, column 'time_s': 4 s follows 2 s"),
        ("t,speed_mph\n0,1\n", "", "needs at least 2"),
    ],
)
def test_broken_cycles_are_refused(tmp_path: Path, text: str, unit: str, said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        cps_envs.read_drive_cycle(written(tmp_path, text), unit)


def test_what_sumo_recorded_of_a_vehicle(tmp_path: Path) -> None:
    path = written(tmp_path, FCD, "fcd.xml")
    lead, truck = cps_envs.read_fcd(path, "lead"), cps_envs.read_fcd(path, "truck")
    assert (lead.values[:, 0].tolist(), lead.step_s, lead.begin_s) == ([10.5, 11.0, 12.0], 0.5, 0.0)
    assert (truck.values[:, 0].tolist(), truck.begin_s) == ([3.0, 4.5], 0.5)


@pytest.mark.parametrize(
    ("text", "vehicle", "said"),
    [
        (FCD, "", "has 2 vehicles: name one, such as vehicle='lead'"),
        (FCD, "trunk", "has no vehicle 'trunk'.*'truck'"),
        ("<fcd-export></fcd-export>", "", "no vehicle in it"),
        (FCD[:-20], "lead", "cannot be read as SUMO's fcd-output"),
        (FCD.replace(' speed="3"', ""), "lead", "cannot be read as SUMO's fcd-output: 'speed'"),
        (FCD.replace("10.50", "fast"), "lead", "could not convert"),
        ('<!DOCTYPE a [<!ENTITY b "c">]>' + FCD, "lead", "declares a document type"),
        ("<!--" + " " * 5000 + '--><!DOCTYPE a [<!ENTITY b "c">]>' + FCD, "lead", "declares a document type"),
        ("<a>" * 9 + "</a>" * 9, "lead", "nested too deeply"),
        ('<?xml version="1.0" encoding="foo"?>' + FCD, "lead", "cannot be read as SUMO's fcd-output"),
    ],
)
def test_other_files_are_no_recordings(tmp_path: Path, text: str, vehicle: str, said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        cps_envs.read_fcd(written(tmp_path, text, "fcd.xml"), vehicle)


@pytest.mark.parametrize(
    ("name", "seconds", "miles", "fastest_mph"),
    [("udds", 1369, 7.45, 56.7), ("hwfet", 765, 10.26, 59.9), ("us06", 600, 8.01, 80.3)],
)
def test_shipped_cycles_are_those_of_the_epa(name: str, seconds: int, miles: float, fastest_mph: float) -> None:
    """Duration, distance and top speed that the agency publishes."""
    cycle = shipped_cycle(name)
    assert cycle.end_s == seconds
    assert cycle.values.sum() / 1609.344 == pytest.approx(miles, abs=0.005)
    assert cycle.values.max() / 0.44704 == pytest.approx(fastest_mph)
    assert "public domain" in (SHIPPED / f"{name}.csv").read_text()


def test_a_recording_of_too_many_tags_or_in_another_alphabet_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "fcd.xml"
    for data, said in (
        (b"<a/>" * 4_000_001, "has 4000001 tags"),
        (('<!DOCTYPE a [<!ENTITY b "c">]>' + FCD).encode("utf-16"), "cannot be read as SUMO's fcd-output"),
    ):
        path.write_bytes(data)
        with pytest.raises(ConfigurationError, match=said):
            cps_envs.read_fcd(path)
