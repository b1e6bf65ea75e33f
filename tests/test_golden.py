"""Golden trajectories: what each version of an environment does must not change by a single number.

The actions come from a fixed generator, so a file keeps only seeds, returns, some observation entries and the final
metrics. Comparison is by tolerances that cover differences between platforms, not changes of the physics.
`pytest tests/test_golden.py --update-golden` writes the files; only for a new version of an environment.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_envs import PROBLEMS
from cps_envs.core.conformance.actors import Crew
from cps_envs.core.conformance.recording import has_ended
from tests.settings import Golden
from tests.settings import tests_of as settings_of

FOLDER = Path(__file__).parent / "golden"
ROWS, ENTRIES = 13, 16  # points in time, and observation entries, that are kept
BESIDE = ("action_mask", "cost")  # what an info has beside the metrics
CASES = [(name, case) for name in PROBLEMS for case in settings_of(name).golden]


def path_of(name: str) -> Path:
    return FOLDER / f"{name}_v{PROBLEMS[name].version}.json"


def play(name: str, golden: Golden) -> dict[str, Any]:
    """A whole episode, thinned out."""
    env_id = f"cps_envs:{PROBLEMS[name].env_id(golden.role)}"
    env: Any = gymnasium.make(env_id, interface="native", **golden.kwargs).unwrapped
    crew = Crew(env, golden.seed, golden.boldness)
    results: list[tuple[Any, ...]] = [env.reset(seed=golden.seed)]
    total, paid = 0.0, [0.0]
    while not has_ended(env, results[-1]):
        results.append(env.step(crew.act(results[-1][-1])))
        total += results[-1][1]
        paid.append(total)
    times = np.unique(np.linspace(0, len(results) - 1, ROWS).astype(int))
    entries = np.unique(np.linspace(0, results[0][0].size - 1, ENTRIES).astype(int))
    return {
        "role": golden.role,
        "kwargs": dict(golden.kwargs),
        "seed": golden.seed,
        "boldness": golden.boldness,
        "steps": len(results) - 1,
        "terminated": results[-1][2],
        "times": times.tolist(),
        "entries": entries.tolist(),
        "paid": [round(paid[t], 9) for t in times],
        "observations": [[round(float(x), 6) for x in results[t][0][entries]] for t in times],
        "metrics": {
            key: round(value, 9) for key, value in results[-1][-1].items() if key not in ("action_mask", "cost")
        },
    }


@pytest.mark.parametrize(("name", "case"), CASES)
def test_golden(name: str, case: str, request: pytest.FixtureRequest) -> None:
    found = play(name, settings_of(name).golden[case])
    path = path_of(name)
    if request.config.getoption("--update-golden"):
        stored = json.loads(path.read_text()) if path.exists() else {}
        path.write_text(as_text({**stored, case: found}))
    expected = json.loads(path.read_text())[case]
    numbers = ("paid", "observations", "metrics")
    exact = [key for key in expected if key not in numbers]
    assert {key: found[key] for key in exact} == {key: expected[key] for key in exact}
    np.testing.assert_allclose(found["paid"], expected["paid"], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(found["observations"], expected["observations"], rtol=0, atol=2e-5)
    known = {name: found["metrics"][name] for name in expected["metrics"]}  # a version may tell more than it did
    assert known == pytest.approx(expected["metrics"], rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("name", PROBLEMS)
def test_file_holds_the_cases_and_no_others(name: str) -> None:
    assert set(json.loads(path_of(name).read_text())) == set(settings_of(name).golden)


def as_text(stored: dict[str, Any]) -> str:
    """JSON with one line per list of numbers, so that a change shows in a diff."""
    cases = []
    for case, values in stored.items():
        lines = [f'    "{key}": {_lines(value)}' for key, value in values.items()]
        cases.append(f"  {json.dumps(case)}: {{\n" + ",\n".join(lines) + "\n  }")
    return "{\n" + ",\n".join(cases) + "\n}\n"


def _lines(value: Any) -> str:
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[\n      " + ",\n      ".join(json.dumps(row) for row in value) + "\n    ]"
    return json.dumps(value)
