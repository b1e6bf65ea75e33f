"""`python -m tools.peers`: software that others wrote, on our environments, each in a virtual environment of its own.

Builds the wheel, installs it beside each peer, runs tests of tests/interoperability, and writes docs/peers.json and
docs/peers.md: a row for each test, with the first line of its docstring. A peer that has passed with the same wheel is
not run again. Programs of `examples/` that train libraries for a CPU minute are rows of learning, see `learning.py`.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from zipfile import ZipFile

from tools.peers import learning
from tools.peers.venvs import NOTES_AT_MOST, install, python_of, versions

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
TESTS = ROOT / "tests" / "interoperability"
PAGE, DATA = ROOT / "docs" / "peers.md", ROOT / "docs" / "peers.json"
WORK = ROOT / ".peers"
LIMIT_S = 900.0  # of a peer's checks
WORKS, ADAPTED, FAILS = "works", "works with an adapter", "does not work"
LEARNING = "learning"  # the key of these rows in the data
REMARK = "remark"  # the key of a sentence about tests that were not tried anew
HEAD = """# Works with

We try software that others wrote on our environments, each in a virtual environment of its own with our wheel in it.
`make peers` writes this page.
"""
TESTS_HEAD = """## Tests

The table says what tests of the folder `tests/interoperability` do there. The suite runs the same tests where the
software is installed. *Works with an adapter* means that a few lines stand between. The table names them.
"""


@dataclass(frozen=True)
class Peer:
    """A package of others."""

    name: str
    title: str
    packages: tuple[str, ...]  # what pip installs beside our wheel
    shown: tuple[str, ...]  # whose versions the page names
    tests: tuple[str, ...]  # of tests/interoperability: files, or tests of them as in "file::test"
    extras: str = ""  # of ours


TESTING = ("pytest", "hypothesis")  # what pip installs for every peer
PEERS = (
    Peer("gymnasium_", "Gymnasium", ("pygame",), ("gymnasium",), ("test_gymnasium.py",), "[render,video]"),
    Peer("pettingzoo_", "PettingZoo", ("supersuit",), ("pettingzoo", "supersuit"), ("test_pettingzoo.py",)),
    Peer(
        "sb3",
        "stable-baselines3, sb3-contrib",
        (),
        ("stable-baselines3", "sb3-contrib"),
        ("test_stable_baselines3.py",),
        "[sb3]",
    ),
    Peer("rl_zoo", "RL Baselines3 Zoo", ("rl_zoo3",), ("rl_zoo3",), ("test_programs.py::test_rl_zoo",), "[sb3]"),
    Peer("cleanrl", "CleanRL", ("torch", "tensorboard", "tyro"), ("torch",), ("test_programs.py::test_cleanrl",)),
    Peer(
        "torchrl_",
        "TorchRL",
        ("torchrl", "torch"),
        ("torchrl",),
        ("test_torchrl.py::test_single_environments", "test_torchrl.py::test_duels"),
    ),
    Peer("tianshou_", "Tianshou", ("tianshou",), ("tianshou",), ("test_vectors.py::test_tianshou",)),
    Peer(
        "agilerl_",
        "AgileRL",
        ("agilerl",),
        ("agilerl",),
        ("test_vectors.py::test_agilerl", "test_vectors.py::test_agilerl_reshaped"),
    ),
    Peer("rllib", "RLlib", ("ray[rllib]", "torch"), ("ray",), ("test_vectors.py::test_rllib",)),
    Peer("minari_", "Minari", (), ("minari",), ("test_minari.py::test_command",), "[cli,data]"),
    Peer("optuna_", "Optuna", ("optuna",), ("optuna",), ("test_beside.py::test_optuna",), "[sb3]"),
    Peer(
        "openai_agents",
        "openai-agents in the same environment",
        ("openai-agents",),
        ("openai-agents",),
        ("test_beside.py::test_openai_agents",),
        "[cli]",
    ),
)


def main() -> int:
    """Run the peers; returns 1 if one of them does not work."""
    parser = argparse.ArgumentParser(prog="python -m tools.peers", description=__doc__)
    names = [*(each.name for each in PEERS), *(each.name for each in learning.PROGRAMS)]
    parser.add_argument("peers", nargs="*", metavar="NAME", help=f"of {', '.join(names)}; all")
    parser.add_argument("--learning", action="store_true", help="only the rows of learning")
    parser.add_argument(
        "--venvs", type=Path, help="use the environments of this folder as they are; implies --learning"
    )
    parser.add_argument(
        "--keep", action="store_true", help="judge again what a program left, instead of training again"
    )
    args = parser.parse_args()
    unknown = set(args.peers) - set(names)
    if unknown:
        parser.error(f"there is no peer {', '.join(sorted(unknown))}")
    WORK.mkdir(exist_ok=True)
    wheel = None if args.venvs else _wheel()
    found = json.loads(DATA.read_text(encoding="utf-8")) if DATA.is_file() else {}
    if wheel is not None and not args.learning and not args.peers:
        found.pop(REMARK, None)  # every outcome is tried anew
    for peer in PEERS:
        if wheel is not None and not args.learning and (not args.peers or peer.name in args.peers):
            print(f"{peer.title} ...", flush=True)
            found[peer.name] = _run(peer, wheel)
            for check in found[peer.name]["checks"]:
                print(f"  {check['outcome']}: {check['what']}{' - ' + check['note'] if check['note'] else ''}")
            _write(found)
    for program in learning.PROGRAMS:
        if not args.peers or program.name in args.peers:
            print(f"{program.name} ...", flush=True)
            row = learning.learn(program, WORK, wheel, args.venvs, keep=args.keep)
            print(f"  {row}", flush=True)
            found.setdefault(LEARNING, {})[program.name] = row
            _write(found)
    return int(any(each["outcome"] == FAILS for each in _all_checks(found)) or _unlearned(found))


def _write(found: dict[str, Any]) -> None:
    DATA.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text("\n".join(_page(found)) + "\n", encoding="utf-8")


def _all_checks(found: dict[str, Any]) -> list[dict[str, str]]:
    return [check for peer in PEERS if peer.name in found for check in found[peer.name]["checks"]]


def _unlearned(found: dict[str, Any]) -> bool:
    """Whether a program fails without a known reason."""
    return any("failed" in row and not row["note"] for row in found.get(LEARNING, {}).values())


def _wheel() -> Path:
    """The wheel of this source tree."""
    subprocess.run(
        [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(WORK), str(ROOT)],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return max(WORK.glob("cps_envs-*.whl"), key=lambda file: file.stat().st_mtime)


def _stamp(peer: Peer, wheel: Path) -> str:
    """A hash of the wheel's content and of what is installed and run; a wheel's own dates do not count."""
    digest = hashlib.sha256(repr(asdict(peer)).encode())
    for test in peer.tests:
        digest.update((TESTS / test.partition("::")[0]).read_bytes())
    with ZipFile(wheel) as content:
        for name in sorted(content.namelist()):
            digest.update(name.encode() + content.read(name))
    return digest.hexdigest()[:16]


def _run(peer: Peer, wheel: Path) -> dict[str, Any]:
    folder, stamp = WORK / peer.name, _stamp(peer, wheel)
    kept = folder / "result.json"
    if kept.is_file():
        before: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
        if before["stamp"] == stamp:
            return before
    result: dict[str, Any] = {"title": peer.title, "stamp": stamp, "versions": {}, "checks": []}
    wrong = install(folder, wheel, [*peer.packages, *TESTING], peer.extras)
    if wrong:
        result["checks"].append({"what": "installation", "outcome": FAILS, "note": wrong})
        return result
    python = python_of(folder)
    result["versions"] = versions(python, peer.shown)
    result["checks"] = list(_checks(python, peer, folder))
    if all(check["outcome"] != FAILS for check in result["checks"]):
        kept.write_text(json.dumps(result), encoding="utf-8")
    return result


def _checks(python: Path, peer: Peer, folder: Path) -> Iterator[dict[str, str]]:
    """Run the tests, which import our package from the wheel and their helpers from a link to the folder of tests."""
    link, report = WORK / "link", folder / "report.xml"
    link.mkdir(exist_ok=True)
    if not (link / "tests").exists():
        (link / "tests").symlink_to(ROOT / "tests")
    environment = {**os.environ, "CPS_ENVS_QUIET": "1", "PYTHONPATH": str(link), "CUDA_VISIBLE_DEVICES": ""}
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        environment.pop(name, None)
    work = folder / "work"
    work.mkdir(exist_ok=True)
    report.unlink(missing_ok=True)
    options = ["-q", "-p", "no:cacheprovider", "-m", "slow or not slow", f"--junitxml={report}"]
    command = [str(python), "-m", "pytest", *options, *(str(TESTS / test) for test in peer.tests)]
    try:
        done = subprocess.run(
            command, cwd=work, env=environment, capture_output=True, text=True, timeout=LIMIT_S, check=False
        )
    except subprocess.TimeoutExpired:
        yield {"what": "all", "outcome": FAILS, "note": f"not finished after {LIMIT_S:.0f} s"}
        return
    if report.is_file():
        yield from _reports(peer, report)
    else:
        yield {"what": "all", "outcome": FAILS, "note": " ".join((done.stdout + done.stderr)[-NOTES_AT_MOST:].split())}


def _reports(peer: Peer, report: Path) -> Iterator[dict[str, str]]:
    """A check for each test function: it fails if one of its cases does, or is skipped."""
    described = _described(peer)
    wrong: dict[str, str] = {}
    for case in ElementTree.parse(report).getroot().iter("testcase"):
        found = [each for kind in ("failure", "error", "skipped") for each in case.findall(kind)]
        notes = [" ".join(f"{case.get('name')}: {each.get('message')}".split()) for each in found]
        name = str(case.get("name")).partition("[")[0]
        wrong.setdefault(name, "")
        wrong[name] = wrong[name] or "".join(notes)[:NOTES_AT_MOST].replace("|", "/")
    for name, note in wrong.items():
        what, adapter = described.get(name, (name, ""))
        yield {"what": what, "outcome": FAILS if note else ADAPTED if adapter else WORKS, "note": note or adapter}


def _described(peer: Peer) -> dict[str, tuple[str, str]]:
    """What a test does, by the first line of its docstring, and what stands between, by a line `Adapter: ...`."""
    found = {}
    for file in dict.fromkeys(test.partition("::")[0] for test in peer.tests):
        for node in ast.parse((TESTS / file).read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and (text := ast.get_docstring(node)):
                found[node.name] = text.splitlines()[0], text.partition("Adapter: ")[2]
    return found


def _page(found: dict[str, Any]) -> Iterator[str]:
    yield HEAD
    if found.get(LEARNING):
        order = [each.name for each in learning.PROGRAMS if each.name in found[LEARNING]]
        yield from learning.page({name: found[LEARNING][name] for name in order})
        yield ""
    yield TESTS_HEAD
    if REMARK in found:
        yield f"{found[REMARK]}\n"
    yield "| software | version | what was done | outcome |\n|---|---|---|---|"
    for peer in PEERS:
        if peer.name in found:
            each = found[peer.name]
            versions = ", ".join(f"{name} {version}" for name, version in each["versions"].items())
            for check in each["checks"]:
                note = f": {check['note']}" if check["note"] else ""
                yield f"| {each['title']} | {versions} | {check['what']} | {check['outcome']}{note} |"


if __name__ == "__main__":
    sys.exit(main())
