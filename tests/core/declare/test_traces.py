from __future__ import annotations

import gzip
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cps_envs.core.declare.config import configure
from cps_envs.core.declare.series import Series
from cps_envs.core.declare.traces import read_table, read_traces
from cps_envs.core.errors import ConfigurationError
from tests.core.declare.test_series import Shed

UNITS = {"outdoor_c": "C", "heat_w": "W", "leader_speed_mps": "m/s"}
HEAD = "time_s,outdoor_c\n"


def written(folder: Path, text: str, name: str = "shed.csv") -> Path:
    path = folder / name
    path.write_bytes(gzip.compress(text.encode()) if name.endswith(".gz") else text.encode())
    return path


def test_columns_become_series(tmp_path: Path) -> None:
    text = "# made up\ntime_s, outdoor_c ,heat_w_2,heat_w_1\n\n3600,1.5,4,2\n7200,2.5,5,3\n10800,2,6,4\n"
    for name in ("shed.csv", "shed.csv.gz", "SHED.CSV"):
        found = read_traces(written(tmp_path, text, name), UNITS)
        assert found == {
            "outdoor_c": Series([1.5, 2.5, 2.0], 3600, 3600),
            "heat_w": Series([[2, 4], [3, 5], [4, 6]], 3600, 3600),
        }
    assert found["outdoor_c"].place(0) == "line 4 of SHED.CSV"


def test_what_spreadsheets_write_is_read(tmp_path: Path) -> None:
    found = read_traces(written(tmp_path, '\ufeff"time_s","outdoor_c"\r\n0,1e1\r\n0.1,-2\r\n0.2,3'), UNITS)
    assert found["outdoor_c"].values[:, 0].tolist() == [10, -2, 3]
    assert found["outdoor_c"].step_s == pytest.approx(0.1)


def test_a_configuration_takes_a_file(tmp_path: Path) -> None:
    path = written(tmp_path, "time_s,outdoor_c,heat_w_1,heat_w_2\n0,1,2,3\n60,1,2,3\n")
    shed = configure(Shed(), {"traces": path, "rooms": 2})
    assert shed == Shed(outdoor_c=Series([1, 1], 60), heat_w=Series([[2, 3]] * 2, 60))
    with pytest.raises(ConfigurationError, match="outdoor_c is given, and"):
        configure(Shed(), {"traces": str(path), "outdoor_c": 3})
    with pytest.raises(ConfigurationError, match=r"line 3 of hot.csv: 70 is outside"):
        configure(Shed(), {"traces": written(tmp_path, HEAD + "0,1\n60,70\n", "hot.csv")})
    assert configure(Shed(), {"traces": None}) == Shed()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty"),
        ("# only a comment\n", "is empty"),
        (HEAD, "has 0 line"),
        (HEAD + "0,1\n", "has 1 line"),
        ("outdoor_c\n1\n2\n", "no column 'time_s'"),
        ("time,outdoor_c\n0,1\n1,2\n", "column 'time', which is no series"),
        ("time_s\n0\n1\n", "times only"),
        ("time_s,outdoor_f\n0,50\n1,51\n", "outdoor is in C here: convert it and name it 'outdoor_c'"),
        ("time_s,leader_speed_kmh\n0,50\n1,51\n", "leader_speed is in m/s here"),
        ("time_s,outdor_c\n0,5\n1,5\n", "Did you mean 'outdoor_c'"),
        ("time_s,outdoor_c,outdoor_c\n0,5,5\n1,5,5\n", "'outdoor_c' twice"),
        ("time_s,outdoor_c,\n0,5,5\n1,5,5\n", "without a name"),
        ("time_s;outdoor_c\n0;5\n1;5\n", "line 1: separate columns by commas"),
        (HEAD + "0,1\n60\n", "line 3 has 1 columns, and the first 2"),
        (HEAD + "0,1\n60,2,3\n", "line 3 has 3 columns"),
        (HEAD + "0,1\n60,\n120,1\n", "line 3, column 'outdoor_c': is empty; fill the gap"),
        (HEAD + "0,1\n60,warm\n", "line 3, column 'outdoor_c': 'warm' is no number"),
        (HEAD + "0,1\n60,nan\n", "line 3, column 'outdoor_c': nan is no measured value"),
        (HEAD + "0,1\n60,inf\n", "line 3, column 'outdoor_c': inf"),
        (HEAD + "nan,1\n60,2\n", "line 2, column 'time_s': nan"),
        (HEAD + "0,1\n60,2\n30,3\n", "line 4, column 'time_s': 30 s comes after 60 s"),
        (HEAD + "0,1\n60,2\n60,3\n120,4\n", "line 4, column 'time_s': 60 s comes after 60 s"),
        (HEAD + "0,1\n60,2\n180,3\n240,4\n", "line 4, column 'time_s': 180 s follows 60 s.*fill the gap"),
        (HEAD + "2024-01-01,1\n2024-01-02,2\n", "'2024-01-01' is no number"),
        ("time_s,heat_w_1,heat_w_3\n0,1,1\n1,1,1\n", "columns of heat_w 1, 3"),
        ("time_s,heat_w,heat_w_1\n0,1,1\n1,1,1\n", "columns of heat_w 0, 1"),
        ('time_s,outdoor_c\n0,"1\n2"\n', "line break inside quotation marks"),
    ],
)
def test_broken_files_are_refused_with_line_and_column(tmp_path: Path, text: str, said: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(ConfigurationError, match=said) as caught:
        read_traces(path, UNITS)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_is_no_such_file_is_refused(tmp_path: Path) -> None:
    for name, data, said in (
        ("a.xlsx", b"", r"save it as .csv, .csv.gz, .parquet"),
        ("a.csv.gz", b"no gzip", "cannot be read: Not a gzipped file"),
        ("b.csv.gz", gzip.compress(HEAD.encode() * 99)[:-9], "cannot be read: "),
        ("a.csv", b"\xff\xfe\x00", "no text in UTF-8"),
        ("a.parquet", b"nothing", "pyarrow|cannot be read as Parquet"),
    ):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(ConfigurationError, match=said):
            read_traces(tmp_path / name, UNITS)
    for name in ("missing.csv", ""):
        with pytest.raises(ConfigurationError, match=r"No such file|no file of series"):
            read_traces(tmp_path / name, UNITS)


def test_parquet_is_read_where_pyarrow_is(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    table = pyarrow.table({"time_s": np.arange(3.0), "outdoor_c": [1, 2, 3]})
    parquet.write_table(table, tmp_path / "a.parquet")
    assert read_traces(tmp_path / "a.parquet", UNITS) == {"outdoor_c": Series([1, 2, 3], 1)}


def test_tables_of_too_many_cells_or_columns_are_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "house.csv"
    path.write_text("time_s" + "," * 4_000_001)
    with pytest.raises(ConfigurationError, match="has 4000001 cells, more than 4000000"):
        read_table(path)
    path.write_text(",".join(f"c{column}" for column in range(1001)))
    with pytest.raises(ConfigurationError, match="has 1001 columns, more than 1000"):
        read_table(path)


def test_a_small_parquet_file_that_unfolds_is_refused_unread(tmp_path: Path) -> None:
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "house.parquet"
    parquet.write_table(pyarrow.table({"time_s": np.zeros(4_000_001)}), path)
    assert path.stat().st_size < 100_000
    with pytest.raises(ConfigurationError, match="has 4000001 cells"):
        read_table(path)


def times(*given: float) -> str:
    return HEAD + "".join(f"{time},{place}\n" for place, time in enumerate(given))


def test_times_may_be_rounded_to_a_thousandth_of_a_step(tmp_path: Path) -> None:
    found = read_traces(written(tmp_path, times(30, 90.05, 150, 210)), UNITS)["outdoor_c"]
    assert (found.step_s, found.begin_s) == (60, 30)
    with pytest.raises(ConfigurationError, match=r"line 3, column 'time_s': 90\.07 s follows 30 s, and the usual step"):
        read_traces(written(tmp_path, times(30, 90.07, 150.07, 210.07)), UNITS)
    with pytest.raises(ConfigurationError, match=r"line 3, column 'time_s': 0\.902 s follows 0 s"):
        read_traces(written(tmp_path, times(0, 0.902, 1.804, 2.705, 3.605, 4.505, 5.405, 6.305)), UNITS)
    with pytest.raises(ConfigurationError, match=r"line 5, column 'time_s': 120 s comes after 180 s; sort the lines"):
        read_traces(written(tmp_path, times(0, 100, 180, 120)), UNITS)


def test_bodies_are_ordered_by_number_and_named_from_1_on(tmp_path: Path) -> None:
    names = [*range(11, 0, -1)]
    text = ",".join(["time_s", *(f"heat_w_{name}" for name in names)]) + "\n"
    text += "".join(",".join(map(str, [step, *names])) + "\n" for step in (0, 5))
    assert read_traces(written(tmp_path, text), UNITS)["heat_w"] == Series([list(range(1, 12))] * 2, 5)
    for text, said in (
        ("time_s,heat_w_2\n0,1\n1,1\n", "heat_w 2: give one without"),
        ("time_s,heat_w_0,heat_w_1\n0,1,1\n1,1,1\n", "heat_w 0, 1: give one"),
    ):
        with pytest.raises(ConfigurationError, match=said):
            read_traces(written(tmp_path, text), UNITS)
    with pytest.raises(ConfigurationError, match="'heat_1', but heat is in W here: convert it and name it 'heat_w'"):
        read_traces(written(tmp_path, "time_s,heat_1\n0,1\n1,1\n"), UNITS)


def test_what_unpacks_to_too_much_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = times(0, 1, 2)
    monkeypatch.setattr("cps_envs.core.declare.traces.MOST_BYTES", 200)
    path = written(tmp_path, text + "#" * (200 - len(text)), "a.csv.gz")
    assert read_traces(path, UNITS)["outdoor_c"].values[:, 0].tolist() == [0, 1, 2]
    with pytest.raises(ConfigurationError, match=r"cannot be read: it unpacks to more than 200 bytes\."):
        read_traces(written(tmp_path, text + "#" * (201 - len(text)), "a.csv.gz"), UNITS)


class Column:
    def __init__(self, values: list[Any]) -> None:
        self.to_numpy = lambda: values


class Read(dict[str, Any]):
    column_names = ("time_s", "outdoor_c", "heat_w")
    num_rows = 2


@pytest.mark.parametrize(
    ("read", "said"),
    [
        (Read(time_s=Column([10, 20]), outdoor_c=Column([1, 2]), heat_w=Column([3, 4])), ""),
        (
            Read(time_s=Column([10, 20]), outdoor_c=Column([1, None]), heat_w=Column([3, 4])),
            "row 2, column 'outdoor_c'",
        ),
        (Read(time_s=Column([20, 10]), outdoor_c=Column([1, 2]), heat_w=Column([3, 4])), "row 2, column 'time_s'"),
        (Read(time_s=Column([1, 2]), outdoor_c=Column(["a", "b"]), heat_w=Column([3, 4])), "'outdoor_c': it does not"),
        (OSError("no magic\nmore"), "cannot be read as Parquet: no magic."),
    ],
)
def test_parquet_is_rows_and_columns(read: Any, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without pyarrow, of which only what it returns counts."""

    def read_table(reader: bytes) -> Any:
        if isinstance(read, Exception):
            raise read
        return read

    lib = SimpleNamespace(ArrowException=RuntimeError)
    about = SimpleNamespace(num_rows=2, num_columns=3)
    parquet = SimpleNamespace(read_table=read_table, read_metadata=lambda reader: about)
    monkeypatch.setitem(sys.modules, "pyarrow", SimpleNamespace(BufferReader=bytes, lib=lib, parquet=parquet))
    path = written(tmp_path, "PAR1", "a.parquet")
    if not said:
        assert read_traces(path, UNITS) == {"outdoor_c": Series([1, 2], 10, 10), "heat_w": Series([3, 4], 10, 10)}
        assert read_traces(path, UNITS)["heat_w"].place(1) == "line 2 of a.parquet"
        return
    with pytest.raises(ConfigurationError, match=said):
        read_traces(path, UNITS)
