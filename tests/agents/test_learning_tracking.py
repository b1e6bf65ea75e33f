"""Where the curves of a run go, and runs that are repeated from what they left."""

from __future__ import annotations

import json
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch")

from cps_agents.errors import CommandError
from cps_agents.learning.learner import learn
from cps_agents.learning.run import TrainingJob, read_earlier
from cps_agents.learning.tracking import make_tracker
from cps_agents.zoo.files import load
from cps_envs.core.documents import DamagedFileError
from cps_envs.core.errors import MissingExtraError
from tests.agents.command_line import succeeded
from tests.agents.test_ppo import recipe_of

RECIPE = recipe_of("attacker", total_timesteps=1_280)


def test_tensorboard_reads_what_was_logged(tmp_path: Path) -> None:
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    tracker = make_tracker("tensorboard", tmp_path)
    tracker.log({"validation/score": 2.0}, 10)
    tracker.log({"validation/score": 3.0}, 20)
    tracker.close()
    events = EventAccumulator(str(tmp_path / "tensorboard"), size_guidance={"tensors": 0})
    events.Reload()
    assert [event.step for event in events.Tensors("validation/score")] == [10, 20]


def test_a_full_disk_is_told_in_a_sentence_that_names_the_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from tensorboard.summary.writer.record_writer import RecordWriter

    def full(writer: Any) -> None:
        raise OSError(28, "No space left on device")

    before, tracker = threading.excepthook, make_tracker("tensorboard", tmp_path)
    monkeypatch.setattr(RecordWriter, "flush", full)
    with pytest.raises(OSError, match=r"cannot be written: No space left on device: .*tensorboard"):  # noqa: PT012
        for steps in range(100):
            tracker.log({"validation/score": 2.0}, steps)
    assert "Traceback" not in capsys.readouterr().err
    monkeypatch.undo()
    tracker.close()
    assert threading.excepthook == before


def test_an_unknown_or_missing_tracker_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(CommandError, match="tensorboard"):
        make_tracker("tensorbord", tmp_path)
    monkeypatch.setitem(sys.modules, "tensorboard", None)
    with pytest.raises(MissingExtraError, match=r"cps-envs\[train\]"):
        make_tracker("tensorboard", tmp_path)


def test_a_run_is_repeated_from_its_file(tmp_path: Path) -> None:
    learn(TrainingJob(RECIPE, 3, tmp_path / "first", "cps-envs train", tracker="none"))
    earlier = read_earlier(tmp_path / "first" / "run.json")
    assert (earlier.seed, earlier.recipe) == (3, RECIPE)
    command = ["train", "--config", str(tmp_path / "first" / "run.json"), "--out", str(tmp_path), "--tracker", "none"]
    succeeded(*command)
    again = tmp_path / RECIPE.name / "seed-3" / "policy.json"
    first, second = (load(path)[1].tensors() for path in (tmp_path / "first" / "policy.json", again))
    for name, array in first.items():
        np.testing.assert_array_equal(array, second[name])


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"recipe": {"nonsense": 1}, "seed": 0, "base": ""}', "[" * 100_000])
def test_a_file_that_is_no_run_is_named(text: str, tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    path.write_text(text)
    with pytest.raises((CommandError, DamagedFileError), match=r"run\.json|no knob"):
        read_earlier(path)
    path.write_text(json.dumps({"recipe": {}, "seed": 0, "base": "gone"}))
    with pytest.raises(CommandError, match="'gone'"):
        read_earlier(path)
