from __future__ import annotations

from pathlib import Path

import pytest

from cps_agents import docs


def test_the_generated_page_is_current(capsys: pytest.CaptureFixture[str]) -> None:
    assert docs.main(["--check"]) == 0, capsys.readouterr().err


def test_an_old_page_is_found_and_written_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(docs, "FOLDER", tmp_path)
    assert docs.main(["--check"]) == 1
    assert "make docs" in capsys.readouterr().err
    assert docs.main([]) == 0
    assert docs.main(["--check"]) == 0


def test_the_page_has_the_tables_of_every_role() -> None:
    page = docs.environments()
    for heading in ("## DisbandingAttack", "## DisbandingDefense", "### Observation Space", "policies of the defender"):
        assert heading in page
    assert "| 0-9 | `mean_speed` |" in page
    assert "`vehicle_0` to `vehicle_99`" in page
