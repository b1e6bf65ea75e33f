"""Every test has a folder of finished meetings of its own; learners of others may run on one thread."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def meetings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where commands keep finished meetings."""
    folder = tmp_path / "meetings"
    monkeypatch.setenv("CPS_ENVS_MEETINGS", str(folder))
    return folder


@pytest.fixture
def one_thread() -> Iterator[None]:
    """PyTorch on one thread, for learners that would take them all."""
    torch = pytest.importorskip("torch")
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)
