"""Commands on a local Ray cluster of two nodes: the page's own lines, and what dies in the middle."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("ray", reason="needs cps-envs[ray]")
pytest.importorskip("aiohttp", reason="needs cps-envs[ray], with the dashboard")
pytest.importorskip("scipy", reason="needs the baselines")

from tests.processes import wait_until

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "cluster.md"
SUBMITTED = re.compile(r"^\$ ray job submit .*? -- (.*)$", re.M)
SHORT = {  # what makes the page's commands short
    "train": "--steps 2000 --seeds 2 --knob num_envs=4 --knob n_steps=32 --knob batch_size=64",
    "league": "--episodes 2 --attacker square --attacker none --defender pd --defender none",
    "evaluate": "--episodes 2",
}
MEET = ("evaluate", "rogue", "attacker", "--attacker", "square", "--attacker", "contested", "--attacker", "none")
MEETING = (*MEET, "--defender", "pd", "--defender", "none", "--episodes", "400", "--json")


class Nodes:
    """A cluster of processes of this machine."""

    def __init__(self, folder: Path) -> None:
        from ray.cluster_utils import Cluster

        os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        self.head: dict[str, Any] = {"num_cpus": 1, "object_store_memory": 80_000_000}
        ports = {"include_dashboard": True, "dashboard_port": 28265, "ray_client_server_port": 20101}
        self.cluster = Cluster(initialize_head=True, head_node_args={**self.head, **ports})
        self.second = self.cluster.add_node(**self.head)
        self.folder = folder

    @property
    def dashboard(self) -> str:
        """Where jobs are submitted to."""
        return f"http://{self.cluster.head_node.webui_url}"

    def environment(self) -> dict[str, str]:
        """That of a process on the head."""
        return {**os.environ, "RAY_ADDRESS": self.cluster.address, "CPS_ENVS_MEETINGS": str(self.folder / "meetings")}

    def start(self, *words: str) -> subprocess.Popen[str]:
        """`cps-envs WORDS` in the folder."""
        command = [sys.executable, "-c", "from cps_agents.command import main; main()", *words]
        pipe = subprocess.PIPE
        return subprocess.Popen(command, cwd=self.folder, env=self.environment(), stdout=pipe, stderr=pipe, text=True)

    def run(self, *words: str) -> str:
        """What `cps-envs WORDS` prints."""
        process = self.start(*words)
        printed, told = process.communicate(timeout=300)
        assert process.returncode == 0, told
        return printed


@pytest.fixture(scope="module")
def nodes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Nodes]:
    """One head and one more node, each with a core."""
    found = Nodes(tmp_path_factory.mktemp("shared"))
    yield found
    found.cluster.shutdown()


def standings(printed: str) -> list[Any]:
    return [(each["policy"], each["opponent"], each["values"]) for each in json.loads(printed)["standings"]]


@pytest.fixture(scope="module")
def here(nodes: Nodes) -> list[Any]:
    """What the meetings give on this machine."""
    return standings(nodes.run(*MEETING, "--jobs", "1", "--meetings", "alone"))


@pytest.mark.parametrize("address", ["auto", "ray://127.0.0.1:20101"])
def test_a_cluster_gives_the_bits_of_this_machine(address: str, nodes: Nodes, here: list[Any]) -> None:
    kept = f"meetings-{address[:4]}"
    assert standings(nodes.run(*MEETING, "--cluster", address, "--meetings", kept)) == here
    assert len(list((nodes.folder / kept).glob("*.json"))) == 6


@pytest.mark.parametrize("line", SUBMITTED.findall(PAGE.read_text(encoding="utf-8")))
def test_the_lines_of_the_page_run_when_they_are_submitted(line: str, nodes: Nodes) -> None:
    words = line.replace("/shared", str(nodes.folder)).split()
    words += SHORT[words[1]].split()
    submit = [str(Path(sys.executable).parent / "ray"), "job", "submit", "--address", nodes.dashboard, "--", *words]
    done = subprocess.run(submit, capture_output=True, text=True, timeout=500, env={**os.environ, "RAY_ADDRESS": ""})
    assert done.returncode == 0, done.stdout + done.stderr
    assert "succeeded" in done.stdout + done.stderr


def workers(node: Any) -> list[int]:
    """Processes of a node that do a piece of our work."""
    (raylet,) = node.all_processes["raylet"]
    parent = raylet.process.pid
    children = Path(f"/proc/{parent}/task/{parent}/children").read_text(encoding="utf-8").split()
    return [int(each) for each in children if Path(f"/proc/{each}/cmdline").read_bytes().startswith(b"ray::do")]


def kill_one(node: Any) -> bool:
    """Kill a process that does a piece of our work, once there is one."""
    with suppress(OSError):
        for process in workers(node):
            os.kill(process, signal.SIGKILL)
            return True
    return False


def test_a_killed_worker_and_a_lost_node_lose_no_finished_meeting_and_change_no_bit(
    nodes: Nodes, here: list[Any]
) -> None:
    kept = nodes.folder / "dying"
    process = nodes.start(*MEETING, "--cluster", "auto", "--meetings", str(kept))
    assert wait_until(lambda: kill_one(nodes.cluster.head_node), 200)
    assert wait_until(lambda: list(kept.glob("*.json")), 200)
    assert wait_until(lambda: workers(nodes.second), 200)
    before = {path: path.stat().st_mtime_ns for path in kept.glob("*.json")}
    nodes.cluster.remove_node(nodes.second, allow_graceful=False)
    assert process.poll() is None
    printed, told = process.communicate(timeout=400)
    nodes.second = nodes.cluster.add_node(**nodes.head)
    assert process.returncode == 0, told
    assert standings(printed) == here
    assert {path: path.stat().st_mtime_ns for path in before} == before


def test_a_run_whose_worker_is_killed_ends_with_the_same_network(nodes: Nodes) -> None:
    pytest.importorskip("torch", reason="needs training")
    short = ("--preset", "easy", "--defender", "none", "--set", "duration_s=3", "--set", "onset_s=0")
    knobs = [f"--knob={each}" for each in ("evaluation_episodes=2", "num_envs=4", "evaluations=4")]
    words = ("train", "RogueAttack-v0", "--seeds", "1", "--steps", "40000", *short, *knobs, "--tracker", "none")
    process = nodes.start(*words, "--cluster", "auto", "--out", "there")
    assert wait_until(lambda: list(nodes.folder.glob("there/*/seed-0/evaluations.jsonl")), 300)
    assert kill_one(nodes.cluster.head_node) or kill_one(nodes.second)
    _, told = process.communicate(timeout=400)
    assert process.returncode == 0, told
    nodes.run(*words, "--jobs", "1", "--out", "alone")
    there, alone = (
        nodes.folder / name / "rogue-attack" / "seed-0" / "policy.safetensors" for name in ("there", "alone")
    )
    assert there.read_bytes() == alone.read_bytes()
