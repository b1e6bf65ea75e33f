"""What somebody may hand in, and what it gains: what the policy reaches when the verifier plays it."""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("scipy", reason="needs the baselines")
pytest.importorskip("typer", reason="needs the command line")

from cps_agents.errors import CommandError
from cps_agents.scoring import apart, board, frozen, kind, results, submission, verify
from cps_agents.scoring import tracks as declared
from cps_agents.scoring.kind import Kind, kind_of
from cps_agents.scoring.playing import seeds_of
from cps_agents.scoring.submission import read_submission
from cps_agents.scoring.tracks import Track
from cps_agents.zoo.card import read_card
from cps_agents.zoo.files import load, save
from cps_agents.zoo.wired import Head, card_entry, count_actions
from cps_envs.core.declare.seeds import SPLITS, is_judged, score_seeds
from cps_envs.core.documents import DamagedFileError
from cps_envs.core.errors import PolicyError
from cps_envs.core.learning.wiring import Wired, Wiring
from cps_envs.core.policies.adapter import adapter_of
from cps_envs.registration import find_problem
from tests.agents.command_line import refusal, succeeded
from tests.agents.test_scoring import CONSTANTS, DEFENSE, EPISODES, SMALL, made
from tests.agents.trained import save_tiny, tiny_network
from tools.challenge import freezing

NEUTRAL = """
import numpy as np

def policy(spec):
    return Player(spec.neutral_action)

class Player:
    def __init__(self, action):
        self.action = action

    def predict(self, observation, state=None, episode_start=None, deterministic=False, action_masks=None):
        {}
        return np.tile(self.action, (len(observation), 1)), state
"""


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Two small tracks, frozen, and an empty leaderboard."""
    made = tmp_path_factory.mktemp("clone")
    (made / "frozen").mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(declared, "tracks", lambda: {track.name: track for track in (SMALL, DEFENSE)})
        patch.setattr(frozen, "FOLDER", made / "frozen")
        patch.setattr(freezing, "declared", lambda _, role: CONSTANTS * (role == "attacker"))
        for track in (SMALL, DEFENSE):
            freezing.freeze(track, 64)
        yield made


@pytest.fixture
def boards(tree: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    found = tmp_path / "leaderboard" / "v1"
    monkeypatch.setattr(board, "FOLDER", found)
    return found


def entry(boards: Path, files: dict[str, str | bytes], name: str = "mine", track: str = "fdi-attack") -> Path:
    """A folder with these files."""
    folder = boards / track / name
    folder.mkdir(parents=True)
    for file, content in files.items():
        (folder / file).write_bytes(content if isinstance(content, bytes) else content.encode())
    return folder


def registered(boards: Path, policy: str, name: str = "mine", track: str = "fdi-attack") -> Path:
    return entry(boards, {"entry.json": json.dumps({"policy": policy})}, name, track)


def network(boards: Path, name: str = "mine", **changed: Any) -> Path:
    """An entry of random weights."""
    folder = entry(boards, {}, name)
    save_tiny(folder / "policy.json", "fdi", "attacker", **{"preset": "learning", **changed})
    return folder


def test_a_forged_result_is_written_anew_and_never_read(boards: Path) -> None:
    folder = registered(boards, "none")
    honest = verify.verify(folder)
    path = folder / "result.json"
    document = json.loads(path.read_text())
    raised = {**document, "pays": {"": [" ".join(["9.5"] * EPISODES)] * 2}}
    path.write_text(json.dumps(raised))
    with pytest.raises(DamagedFileError, match="not those of its own pays"):
        results.read_score(folder)
    path.write_text("nonsense")
    assert verify.verify(folder).line == honest.line
    assert json.loads(path.read_text())["pays"] == document["pays"]
    assert results.read_score(folder).line == results.read_score(path).line == honest.line


def test_a_result_is_of_the_entry_that_was_played(boards: Path) -> None:
    folder = registered(boards, "none")
    with pytest.raises(CommandError, match=r"no entry that the verifier has played"):
        results.read_score(folder)
    verify.verify(folder)
    (folder / "entry.json").write_text('{"policy": "tracker"}')
    with pytest.raises(CommandError, match="has changed since it was played: run `make verify`"):
        results.read_score(folder)


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"entry.json": '{"policy": "none", "kind": "from scratch"}'}, "one line, the policy"),
        ({"entry.json": '{"policy": "none"}', "pays.json": "[]"}, "holds entry.json, pays.json: an entry is"),
        ({"policy.pkl": pickle.dumps(1)}, "holds policy.pkl: an entry is"),
        ({}, "holds nothing: an entry is"),
        ({"entry.json": '{"policy": "none"}', "policy.py": "def policy(spec): ..."}, "holds entry.json, policy.py"),
        ({"policy.py": "def policy(spec"}, "is no Python code"),
        ({"policy.py": "print(1)"}, r"has no function policy\(spec\)"),
        ({"policy.py": b"# \xff\ndef policy(spec): ..."}, "is no Python code"),
        ({"policy.py": "#" * 2**19}, "more than"),
        ({"entry.json": '{"policy": "cusum"}'}, "may name a policy of the attacker of fdi"),
        ({"entry.json": '{"policy": "sb3:model.zip"}'}, "may name a policy of the attacker of fdi"),
        ({"entry.json": '{"policy": "os:system"}'}, "may name a policy of the attacker of fdi"),
        ({"entry.json": '{"policy": "zoo:../../other"}'}, "may name a policy of the attacker of fdi"),
        ({"entry.json": '{"policy": "zoo:fdi-defense"}'}, "is of the defender of fdi, and fdi-attack is another role"),
        ({"entry.json": '{"policy": "zoo:fdi-attack?untrained=true"}'}, "may have the option seed only"),
        (
            {"entry.json": '{"policy": "mixture?policies=[\\"none\\",\\"tracker\\"]"}'},
            "may name a policy of the attacker",
        ),
        ({"entry.json": '{"policy": "trace?file=/etc/passwd"}'}, "may name a policy of the attacker"),
        ({"entry.json": '{"policy": "tracker?margin=\\"../x\\""}'}, "names a file"),
    ],
    ids=str,
)
def test_a_folder_that_is_no_entry_is_refused(files: Any, message: str, boards: Path) -> None:
    with pytest.raises((CommandError, ValueError), match=message):
        verify.verify(entry(boards, files))


def test_a_folder_leads_nowhere_else(boards: Path, tmp_path: Path) -> None:
    (tmp_path / "secret.json").write_text('{"policy": "none"}')
    folder = entry(boards, {})
    (folder / "entry.json").symlink_to(tmp_path / "secret.json")
    with pytest.raises(CommandError, match="plain files only"):
        read_submission(folder)
    (boards / "fdi-attack" / "link").symlink_to(registered(boards, "none", "real"))
    with pytest.raises(CommandError, match="is no folder"):
        read_submission(boards / "fdi-attack" / "link")
    with pytest.raises(CommandError, match="small letters"):
        read_submission(registered(boards, "none", "My Method"))
    with pytest.raises(LookupError, match="there is no track 'elsewhere'"):
        read_submission(registered(boards, "none", track="elsewhere"))


def test_weights_are_numbers_of_the_right_size_and_role(boards: Path) -> None:
    folder = network(boards)
    assert read_submission(folder).form == "network"
    card, weights = folder / "policy.json", folder / "policy.safetensors"
    document = json.loads(card.read_text())

    def refused(message: str, **changed: Any) -> None:
        card.write_text(json.dumps({**document, **changed}))
        with pytest.raises((CommandError, ValueError), match=message):
            verify.verify(folder)

    refused("is of the attacker of tests.nowhere:EVIL, and fdi-attack is another role", problem="tests.nowhere:EVIL")
    refused("is of the defender of fdi", role="defender")
    refused("does not name the hash of its weights", weights="")
    refused("not the weights that the card was written for", weights="0" * 64)
    refused("damaged", seeds={**document["seeds"], "2": {"steps": 10**9}})  # a seed without weights
    refused("damaged", observation_size=document["observation_size"] - 1)
    refused("has no adapter 'tests.nowhere:evil'", wiring={**document["wiring"], "adapter": "tests.nowhere:evil"})
    refused("no adapter|has actions", wiring={**document["wiring"], "adapter": "motion"})
    weights.write_bytes(pickle.dumps({"layer": [1.0]}))
    refused("holds no safetensors|damaged", weights=hashlib.sha256(weights.read_bytes()).hexdigest())


def test_training_seeds_are_different_networks_and_all_of_the_weights(boards: Path) -> None:
    folder = network(boards)
    path = folder / "policy.json"
    card, first = load(path, 0)
    save(path, card, {0: first, 1: first})
    with pytest.raises(CommandError, match="training seeds 0 and 1 are the same network: hand it in once"):
        read_submission(folder)
    save(path, replace(card, seeds={"0": {}}), {0: first, 7: first})
    with pytest.raises(CommandError, match="which is of none of its training seeds"):
        read_submission(folder)


def test_a_network_plays_in_the_form_of_the_track(boards: Path) -> None:
    """A card must not let its network see more, or act otherwise, than others do."""
    save_tiny(boards / "x.json", "hvac", "attacker", preset="learning", overrides={"attacker_view": "grey"})
    with pytest.raises(CommandError, match=r"was trained with .* and hvac-attack is played as it is"):
        submission._check_form("x", f"zoo:{boards / 'x.json'}", Track("hvac", "attacker", 8, ()))
    with pytest.raises(CommandError, match="does not fit fdi-attack"):
        read_submission(network(boards, preset="paper"))


def test_a_kind_is_found_and_not_said(boards: Path, tmp_path: Path) -> None:
    assert kind_of(SMALL, "tracker") == Kind("hand-set")
    assert kind_of(SMALL, "tracker?margin=0.9") == Kind("searched", numbers=1)  # a number that somebody chose
    assert kind_of(SMALL, "always?action=26") == Kind("searched", numbers=1)
    assert kind_of(DEFENSE, "informed") == Kind("privileged")
    assert kind_of(DEFENSE, "hypotheses") == Kind("searched", numbers=11)
    assert kind_of(DEFENSE, "hypotheses?untrained=true") == Kind("hand-set")
    assert kind_of(DEFENSE, 'mixture?policies=["cusum","informed"]') == Kind("privileged")
    assert kind_of(SMALL, "zoo:fdi-attack") == Kind("from scratch")
    assert kind_of(SMALL, 'mixture?policies=["zoo:fdi-attack","tracker"]').name == "advised"
    assert kind_of(Track("hvac", "defender", 8, ()), "zoo:hvac-defense") == Kind("advised", by="bayes")
    shown = [str(each) for each in (Kind("from scratch"), Kind("advised", by="bayes"), Kind("searched", numbers=11))]
    assert shown == ["network from scratch", "network advised by bayes", "tuned by search, 11 numbers"]
    for wrong in ({"name": "magic"}, {"name": "advised"}, {"name": "searched"}, {"name": "hand-set", "numbers": 1}):
        with pytest.raises(CommandError):
            Kind(**wrong)
    assert "No such option: --kind" in refusal("score", "fdi-attack", "tracker", "--kind", "reward")


def advised(boards: Path, name: str) -> Path:
    """A network with the adapter of a controller, whose actions are neutral whatever it sees: no step of learning."""
    folder = entry(boards, {}, name)
    spec = find_problem("fdi").game(SMALL.venue.config, 1).spec("attacker")
    wiring = Wiring("fdi", "attacker", "task_tracker", 1)
    wired = Wired(wiring, adapter_of(spec, "task_tracker"))
    actions, size = count_actions(wired.adapter.action_space), wired.columns.size
    path = folder / "policy.json"
    save_tiny(path, "fdi", "attacker", preset="learning")
    tiny = tiny_network(size, sum(actions))
    neutral = np.ravel(wired.adapter.neutral_action).astype(np.float32)
    still = replace(tiny, layers=((0 * tiny.layers[0][0], neutral),))
    card = replace(
        read_card(path),
        wiring=card_entry(wiring, Head()),
        actions=actions,
        observation_size=size,
        head="gaussian",
        seeds={"0": {"steps": 10**7}},
    )
    save(path, card, {0: still})
    return folder


def test_who_begins_as_a_controller_is_advised_whatever_its_name(boards: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = verify.verify(advised(boards, "mine"))
    assert found.kind == Kind("advised", by="task_tracker")
    assert found.began is not None
    assert found.estimate.mean == pytest.approx(found.began.estimate.mean)
    assert (found.added.mean, found.added.low, found.added.high) == (0.0, 0.0, 0.0)  # type: ignore[union-attr]
    monkeypatch.setattr(kind, "adviser", lambda track, adapter: "")  # as if its name said nothing
    assert found.began.estimate.low > 0  # type: ignore[operator]
    assert verify.verify(advised(boards, "other")).kind == Kind("advised", by="task_tracker")
    rows = {row.name: row for row in board.board(SMALL)}
    assert rows["mine"].rank == rows["other"].rank == 1
    assert board.table(SMALL, list(rows.values())).rows[0][1] == "network advised by task_tracker, 1 training seed"


def test_a_network_shows_what_it_began_with(boards: Path) -> None:
    found = verify.verify(registered(boards, "zoo:fdi-attack"))
    assert found.kind == Kind("from scratch")
    assert found.began is not None
    assert found.began.estimate.mean < 0 < found.added.low  # type: ignore[union-attr,operator]
    again = results.read_score(boards / "fdi-attack" / "mine")
    assert again.began is not None
    assert (again.began.estimate, again.added, again.kind) == (found.began.estimate, found.added, found.kind)


def test_a_network_that_knows_the_episodes_of_the_leaderboard_is_refused() -> None:
    fresh = made(2)
    knowing = replace(fresh, pays={seed: [rows + 1.0 for rows in paid] for seed, paid in fresh.pays.items()})
    assert "in fresh episodes" in verify._compared(fresh, fresh)
    assert "in fresh episodes" in verify._compared(fresh, knowing)  # better in fresh ones
    with pytest.raises(CommandError, match=r"it knows the former\. Train it on training seeds"):
        verify._compared(knowing, fresh)


def test_fresh_episodes_follow_from_a_key_that_nobody_knew() -> None:
    one, two = (seeds_of(SMALL, "fresh", 50, key) for key in (1, 2))
    assert one == seeds_of(SMALL, "fresh", 50, 1)
    assert len({*one[0], *one[1], *two[0], *two[1]}) == 200
    assert all(seed in SPLITS["fresh"] and is_judged(seed) for seed in one[0])
    assert not set(one[0]) & set(score_seeds("test", 0, 10**5))


PEEK = """
        import gc, os, sys
        frame, seen = sys._getframe(), []
        while frame:
            seen += [type(each).__name__ for each in frame.f_locals.values()]
            frame = frame.f_back
        seen += [type(each).__name__ for each in gc.get_objects()]
        if {"Match", "Seat", "Track", "Told"} & set(seen):
            raise RuntimeError("I see a match")
        if any(name.startswith(("GITHUB", "CPS_ENVS_TRUST", "SECRET")) for name in os.environ) or os.listdir("."):
            raise RuntimeError("I see what I should not")
        print("nobody takes this for an answer")
"""


def test_code_sees_observations_only_and_plays_fresh_episodes(boards: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SECRET_TOKEN", "x")
    folder = entry(boards, {"policy.py": NEUTRAL.format(PEEK)})
    found = verify.verify(folder)
    assert (found.kind, found.split, len(found.key)) == (Kind("code"), "fresh", 32)
    assert "fdi-attack fresh/24" in found.line
    again = results.read_score(folder)
    assert (again.line, again.estimate) == (found.line, found.estimate)
    none = verify.verify(registered(boards, "none", "none"))
    assert abs(found.estimate.mean - none.estimate.mean) < 3 * (found.half_width + none.half_width)
    assert not found.playable
    assert {row.name: row.rank for row in board.board(SMALL)} == {"mine": 1, "none": 1}  # of different ladders


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (
            "from cps_baselines.fdi.informed import Informed as policy",
            "policy.py failed: TypeError: it wants to be told",
        ),
        ("def policy(spec): return 1", "returned an object without predict"),
        ("def policy(spec): return 1 / 0", "policy.py failed: ZeroDivisionError"),
        ("import os\ndef policy(spec): os._exit(0)", "gave no answer"),
        ("import os\ndef policy(spec): os.fork()", "policy.py failed"),
    ],
)
def test_code_that_cannot_play_is_refused_in_one_sentence(source: str, message: str, tree: Path) -> None:
    if "fork" in source and os.geteuid() == 0:
        pytest.skip("root may start processes")
    track = DEFENSE if "informed" in source else SMALL
    with pytest.raises(PolicyError, match=message):
        apart.Process(track, source)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("return [[0.0] * 3] * 2, state", "policy.py answered actions of the shape"),
        ("return np.full((len(observation), 4), 99), state", "impossible actions"),
        ("return np.array(['x'] * len(observation)), state", "actions of type"),
    ],
)
def test_code_that_answers_nonsense_is_refused(line: str, message: str, tree: Path) -> None:
    seeds = seeds_of(SMALL, "fresh", 2, 5)
    with pytest.raises(ValueError, match=message):
        apart.played_apart(SMALL, NEUTRAL.format(line), seeds, 0, lambda done: None)


def test_code_that_is_silent_is_ended(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    process = apart.Process(SMALL, NEUTRAL.format("import time; time.sleep(60)"))
    monkeypatch.setattr(apart, "ANSWER_S", 1)
    shown = {"observation": np.zeros((1, 3), np.float32), "start": np.ones(1, np.bool_)}
    with pytest.raises(PolicyError, match="was silent for 1 s"):
        process.ask(np.arange(1), shown)
    process.close()


def test_code_that_plays_otherwise_the_next_time_is_refused(boards: Path) -> None:
    source = NEUTRAL.format(
        "return np.random.default_rng().integers(20, 30, (len(observation), len(self.action))), state"
    )
    with pytest.raises((CommandError, ValueError), match="plays otherwise when it plays again"):
        verify.verify(entry(boards, {"policy.py": source}))


def test_code_that_changes_files_is_refused(boards: Path) -> None:
    other = registered(boards, "none", "other")
    line = f"open({str(other / 'result.json')!r}, 'a').write('{{}}')"
    with pytest.raises(CommandError, match="has changed files of the leaderboard"):
        verify.verify(entry(boards, {"policy.py": NEUTRAL.format(line)}))


def test_rows_of_all_opponents_arrive_together_in_an_order_of_chance() -> None:
    asked: list[Any] = []

    def ask(rows: Any, parts: Any) -> Any:
        asked.append(rows.tolist())
        return parts["observation"] * 10

    together = apart.Together(ask, [2, 3], np.array([3, 0, 4, 1, 2]))
    found: dict[int, Any] = {}

    def play(place: int, values: Any) -> None:
        for rows in values:
            parts = {"observation": np.array([[100 * place + row] for row in rows])}
            found.setdefault(place, []).append(
                together.ask(place, apart.Question(np.array(rows), parts)).ravel().tolist()
            )
        together.leave(place)

    threads = [
        apart.Thread(target=play, args=(place, values)) for place, values in ((0, [[0, 1], [1]]), (1, [[0, 1, 2]]))
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(10)
    assert asked == [[0, 1, 2, 3, 4], [0]]
    assert found == {0: [[0, 10], [10]], 1: [[1000, 1010, 1020]]}


def test_a_branch_with_somebody_s_policy_changes_nothing_else(boards: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = boards.parents[1]

    def git(*arguments: str) -> None:
        named = ("-c", "user.name=x", "-c", "user.email=x@example.org")
        subprocess.run(["git", *named, *arguments], cwd=root, check=True, capture_output=True)

    registered(boards, "none", "old")
    (boards / "fdi-attack" / "old" / "result.json").write_text("{}")
    git("init", "-b", "main")
    git("add", ".")
    git("commit", "-m", "a")
    git("checkout", "-b", "mine")
    folder = network(boards)
    git("add", ".")
    git("commit", "-m", "b")
    assert verify.changed("main", boards) == [folder]
    assert "No entry has changed" not in refusal("score", "verify", "--since", "nobody")
    (boards / "fdi-attack" / "old" / "result.json").write_text("forged")
    git("commit", "-am", "c")
    assert [each.name for each in verify.changed("main", boards)] == ["mine", "old"]
    (root / "frozen.json").write_text("{}")
    git("add", ".")
    git("commit", "-m", "d")
    with pytest.raises(CommandError, match=r"mine comes with a change of frozen.json"):
        verify.changed("main", boards)
    with pytest.raises(CommandError, match="git cannot compare this branch with nowhere"):
        verify.changed("nowhere", boards)


def test_commands_play_compare_and_show(boards: Path) -> None:
    folder = registered(boards, "tracker")
    text = succeeded("score", "verify", str(folder)).stdout
    assert "100.0 ± 0.0" in text
    assert text.rstrip().endswith("; hand-set")
    text = succeeded("score", "compare", str(folder), str(folder)).stdout
    assert "difference +0.0 (+0.0 to +0.0): not surely different" in text
    text = succeeded("score", "fdi-attack", "tracker").stdout
    assert "Kind: hand-set." in text
    assert "Rank 1 of its kind, controller: of 1 on the leaderboard none is surely better." in text
    assert "name entries" in refusal("score", "verify")
    assert "tracker" not in board.missing(SMALL)
    assert {"mimic", "zoo:fdi-attack"} <= set(board.missing(SMALL))
