"""What lies behind a reference: networks, models and code are found in folders of any name, or refused."""

from __future__ import annotations

import json
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cps_agents.arena.store import Store
from cps_agents.arena.table import Table
from cps_agents.arena.venue import Venue
from cps_agents.league.strategy import mix
from cps_agents.scoring.kind import kind_of
from cps_agents.scoring.tracks import find_track
from cps_agents.zoo.card import read_card
from cps_agents.zoo.files import load, save
from cps_agents.zoo.references import form_of, is_trained, origin_of, reference_to
from cps_envs.core.declare.panel import Contestant, mixture
from cps_envs.core.errors import ConfigurationError, UnknownNameError
from cps_envs.core.game.game import Game
from cps_envs.registration import find_problem
from tests.agents.command_line import invoke
from tests.agents.trained import save_tiny
from tests.turns import in_turn

FOLDERS = [
    "plain",
    "lr=0.001,seed=3",
    "a&b",
    "a]b",
    "[a",
    'a"b',
    "a'b",
    "a b",
    "a?b",
    "a?",
    "a%20b",
    "a+b",
    "a;b",
    "ä",
    "a#b",
]
if sys.platform == "win32":
    FOLDERS = [name for name in FOLDERS if not set('?"') & set(name)]


@pytest.fixture(scope="module")
def easy() -> Game:
    return find_problem("fdi").game(find_problem("fdi").config("easy", {}), 1)


def forms_of_reference(reference: str) -> list[str]:
    """Alone, and inside mixtures as programs and as people write them."""
    quoted = json.dumps([reference, "none"])  # with \\u00e4
    return [reference, mixture([reference, "none"]), f"mixture?policies={quoted.replace('%', '%25')}"]


@pytest.mark.parametrize("folder", in_turn(FOLDERS, 3))
def test_a_network_is_known_by_its_weights_in_any_folder(folder: str, easy: Game, tmp_path: Path) -> None:
    card = tmp_path / folder / "policy.json"
    card.parent.mkdir()
    save_tiny(card, "fdi", "attacker", preset="easy")
    written = read_card(card), {seed: load(card, seed)[1] for seed in (0, 1)}
    config = find_problem("fdi").config("paper", {"attacked": "x1", "target": 1})
    before = {}
    for reference in forms_of_reference(reference_to(card.parent)):
        before[reference] = dict(origin_of("fdi", reference).sources)
        assert list(before[reference]) == [str(card.parent)]
        assert form_of(reference, config) == {"tasks": "x1>1"}
        assert is_trained(reference)
        find_problem("fdi").policy(reference, easy, "attacker")  # it can be played
    save(card, written[0], {seed: written[1][1 - seed] for seed in (0, 1)})
    for reference, sources in before.items():
        after = origin_of("fdi", reference).sources
        assert after.keys() == sources.keys()
        assert after != sources


def test_a_folder_that_ends_like_options_is_named_by_its_card(tmp_path: Path) -> None:
    card = tmp_path / "a?lr=1" / "policy.json"
    card.parent.mkdir()
    save_tiny(card, "fdi", "attacker", preset="easy")
    assert reference_to(card.parent) == f"zoo:{card}"
    assert list(origin_of("fdi", reference_to(card.parent)).seeds.values()) == [f"zoo:{card}?seed={s}" for s in (0, 1)]
    with pytest.raises(UnknownNameError, match="no trained policy"):
        origin_of("fdi", f"zoo:{card.parent}")


def test_a_kept_result_is_not_that_of_another_network(tmp_path: Path) -> None:
    card = tmp_path / "lr=0.1,seed=3" / "policy.json"
    card.parent.mkdir()
    save_tiny(card, "rogue", "attacker", overrides={"duration_s": 4.0})
    venue, store = Venue("rogue", "paper", {"duration_s": 4.0}), Store(tmp_path / "kept")

    def meeting() -> Any:
        return Table(venue, [Contestant(f"zoo:{card.parent}")], [Contestant("pd")], 2).meeting((0, 0))

    store.put(meeting(), {"metrics": {"return": [1.0, 2.0]}, "cpu_s": 0.0})
    assert store.get(meeting()) is not None
    data = np.random.default_rng(1)
    network = load(card, 0)[1]
    other = tuple((data.normal(size=weight.shape).astype(np.float32), bias) for weight, bias in network.layers)
    save(card, read_card(card), {0: network.__class__(**{**vars(network), "layers": other}), 1: network})
    assert store.get(meeting()) is None


@pytest.mark.parametrize(
    ("reference", "reason"),
    [
        ("zoo:nobody", "no trained policy 'nobody'"),
        ("zoo:nobody,2?seed=1", "no trained policy 'nobody,2'"),
        ('mixture?policies=["none","zoo:nobody"]', "no trained policy 'nobody'"),
        ("sb3:no,model.zip", "no file 'no,model.zip'"),
        ('mixture?policies=["sb3:no,model.zip"]', "no file 'no,model.zip'"),
        ("no_such_module:Policy", "no module 'no_such_module'"),
        ('mixture?policies=["no_such_module:Policy"]', "no module 'no_such_module'"),
    ],
)
def test_what_is_not_there_is_an_error(reference: str, reason: str) -> None:
    with pytest.raises(UnknownNameError, match=reason):
        origin_of("fdi", reference)


def test_models_and_code_are_known_by_content_wherever_they_stand(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    model, module = tmp_path / "a,b.zip", tmp_path / "code_of_one.py"
    model.write_bytes(b"1")
    module.write_text("one = 1\n")
    reference = f'mixture?policies=["code_of_one:Mine?inner=sb3:{model}","none"]'
    before = dict(origin_of("fdi", reference).sources)
    assert list(before) == [f"sb3:{model}", "module:code_of_one"]
    model.write_bytes(b"2")
    module.write_text("one = 2\n")
    after = origin_of("fdi", reference).sources
    assert {name for name in before if before[name] != after[name]} == set(before)


def test_networks_of_one_mixture_play_in_one_form(tmp_path: Path) -> None:
    for name, interval_s in (("a", 0.2), ("b", 0.4)):
        (tmp_path / name).mkdir()
        overrides = {"duration_s": 4.0, "attack_hold_s": interval_s}
        save_tiny(tmp_path / name / "policy.json", "rogue", "attacker", overrides=overrides)
    alike, other = (f"zoo:{tmp_path / name}" for name in "ab")
    config = find_problem("rogue").config("paper", {})
    form = {"attack_hold_s": 0.2}
    assert form_of(mixture([alike, f"{alike}?seed=1", "none"]), config) == form == form_of(alike, config)
    assert origin_of("rogue", mixture([alike, "none"])).form(config) == form
    with pytest.raises(ConfigurationError, match=r"need attack_hold_s = 0.4 and 0.2: .* leave one of them out"):
        form_of(mixture([alike, other]), config)


def test_strategies_take_mixtures_apart_whatever_their_names_hold() -> None:
    found = mix([mixture(["zoo:a,b&c", "zoo:ä?x", "none"], [2, 1, 1]), "none"])
    assert dict(zip(found.policies, found.probabilities, strict=True)) == {
        "zoo:a,b&c": 0.25,
        "zoo:ä?x": 0.125,
        "none": 0.625,
    }
    assert mix([found.reference]).policies == found.policies
    with pytest.raises(ValueError, match="no list of texts"):
        mix(["mixture?policies=[3]"])


def test_a_kind_is_that_of_the_networks_inside(tmp_path: Path) -> None:
    track, mine = find_track("fdi-attack"), f"zoo:{tmp_path}"
    save_tiny(
        tmp_path / "policy.json", "fdi", "attacker", preset=track.venue.preset, overrides=dict(track.venue.overrides)
    )
    assert kind_of(track, mixture([mine, "none"])).name == "from scratch"
    assert kind_of(track, mixture([mine, "tracker"])).name == "advised"
    with pytest.raises(ConfigurationError, match="given twice"):
        kind_of(track, f"{mine}?seed=1&seed=0")


MINE = """
import helper_of_one
from cps_envs.core.policies.policy import repeat, AnalyticPolicy
import numpy as np

class Mine(AnalyticPolicy):
    def __init__(self, spec, weights="own_weights.npy"):
        super().__init__(spec)
        self.level = float(np.load(weights)) * helper_of_one.LEVEL

    def act(self, seen, state):
        return repeat(np.array([self.level]), len(seen)), state
"""


def write_mine(folder: Path) -> None:
    (folder / "code_of_two.py").write_text(MINE)
    (folder / "helper_of_one.py").write_text("from inner_package import LEVEL\n")
    (folder / "inner_package").mkdir()
    (folder / "inner_package" / "__init__.py").write_text("from .deep import LEVEL\n")
    (folder / "inner_package" / "deep.py").write_text("import lazy_one\nLEVEL = 1.0\n")
    (folder / "lazy_one.py").write_text("")
    (folder / "logs").mkdir()
    for name in ("own_weights.npy", "other_weights.npy"):
        np.save(folder / name, 1.0)
    (folder / "logs" / "attack.csv").write_text("time_s,attacker_pull\n0,1\n")


@pytest.mark.parametrize(
    ("reference", "changed"),
    [
        ("code_of_two:Mine?weights=other_weights.npy", "other_weights.npy"),
        ("code_of_two:Mine", "own_weights.npy"),  # which only the code names
        ("code_of_two:Mine", "code_of_two.py"),
        ("code_of_two:Mine", "helper_of_one.py"),
        ("code_of_two:Mine", "inner_package/deep.py"),
        ("code_of_two:Mine", "lazy_one.py"),
        ('mixture?policies=["none","trace?file=logs/attack.csv"]', "logs/attack.csv"),
        ('always?action=[1]&notes={"where":["logs"]}', "logs/attack.csv"),  # a folder
    ],
)
def test_what_a_policy_depends_on_is_known_by_content(
    reference: str, changed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)
    write_mine(tmp_path)
    before = dict(origin_of("rogue", reference).sources)
    assert dict(origin_of("rogue", reference).sources) == before
    assert "code_of_two" not in sys.modules  # nothing is run to know it
    with (tmp_path / changed).open("ab") as file:
        file.write(b"\n")
    after = origin_of("rogue", reference).sources
    assert before.keys() == after.keys()
    assert len({name for name in before if before[name] != after[name]}) == 1


def test_an_evaluation_says_what_it_reuses_and_plays_again_what_has_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)
    write_mine(tmp_path)
    short = ["--preset", "paper", "--set", "duration_s=4", "--episodes", "2", "--jobs", "1", "--json"]
    names = ["--attacker", "code_of_two:Mine?weights=own_weights.npy", "--defender", "pd"]
    command = ["--trust", "evaluate", "rogue", "attacker", *names, *short]
    first, again = invoke(*command), invoke(*command)
    assert "Reused" not in first.stderr
    assert "Reused 1 of 1 meetings; --fresh plays them again." in " ".join(again.stderr.split())
    np.save(tmp_path / "own_weights.npy", 0.0)
    changed = invoke(*command)
    assert "Reused" not in changed.stderr
    means = [json.loads(each.stdout)["standings"][0]["mean"] for each in (first, again, changed)]
    assert means[0] == means[1] != means[2]
    assert json.loads(invoke(*command, "--fresh").stdout)["standings"][0]["mean"] == means[2]


def test_a_model_is_known_by_the_code_of_its_classes_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "features_of_one.py").write_text("one = 1\n")
    model = tmp_path / "model.zip"
    with zipfile.ZipFile(model, "w") as archive:
        archive.writestr("data", json.dumps({"policy_kwargs": {"extractor": "<class 'features_of_one.Own'>"}}))
    statistics = tmp_path / "statistics.pkl"
    statistics.write_bytes(b"1")
    reference = f"sb3:{model}?vecnormalize={statistics}"
    before = dict(origin_of("fdi", reference).sources)
    assert set(before) == {f"sb3:{model}", f"file:{statistics}", "module:features_of_one"}
    (tmp_path / "features_of_one.py").write_text("one = 2\n")
    statistics.write_bytes(b"2")
    after = origin_of("fdi", reference).sources
    assert {name for name in before if before[name] != after[name]} == set(before) - {f"sb3:{model}"}
