"""Every test has a folder of finished meetings of its own."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def meetings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where commands keep finished meetings."""
    folder = tmp_path / "meetings"
    monkeypatch.setenv("CPS_ENVS_MEETINGS", str(folder))
    return folder
