"""`python -m tools.peers`: software that others wrote, on our environments, each in a virtual environment of its own.

Builds the wheel, installs it beside each peer, runs the peer's checks, and writes docs/peers.json and docs/peers.md. A
peer that has passed with the same wheel is not run again.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import venv
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from zipfile import ZipFile

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PAGE, DATA = ROOT / "docs" / "peers.md", ROOT / "docs" / "peers.json"
WORK = ROOT / ".peers"
LIMIT_S = 900.0  # of a peer's checks
NOTES_AT_MOST = 300  # characters of an error
WORKS, ADAPTED, FAILS = "works", "works with an adapter", "does not work"
HEAD = """# Works with

We try software that others wrote on our environments. `make peers` makes a virtual environment for each of them, with
our wheel in it. There it runs what the table says. *Works with an adapter* means that a few lines stand between. The
table names them.
"""


@dataclass(frozen=True)
class Peer:
    """A package of others."""

    name: str
    title: str
    packages: tuple[str, ...]  # what pip installs beside our wheel
    shown: tuple[str, ...]  # whose versions the page names
    extras: str = ""  # of ours

    @property
    def script(self) -> Path:
        """Its checks: it prints a line of JSON for each."""
        return HERE / "checks" / f"{self.name}.py"


PEERS = (
    Peer("gymnasium_", "Gymnasium", ("pygame",), ("gymnasium",), "[render,video]"),
    Peer("pettingzoo_", "PettingZoo", ("supersuit",), ("pettingzoo", "supersuit")),
    Peer("sb3", "stable-baselines3, sb3-contrib", (), ("stable-baselines3", "sb3-contrib"), "[sb3]"),
    Peer("rl_zoo", "RL Baselines3 Zoo", ("rl_zoo3",), ("rl_zoo3",), "[sb3]"),
    Peer("cleanrl", "CleanRL", ("torch", "tensorboard", "tyro"), ("torch",)),
    Peer("torchrl_", "TorchRL", ("torchrl", "torch"), ("torchrl",)),
    Peer("tianshou_", "Tianshou", ("tianshou",), ("tianshou",)),
    Peer("agilerl_", "AgileRL", ("agilerl",), ("agilerl",)),
    Peer("rllib", "RLlib", ("ray[rllib]", "torch"), ("ray",)),
    Peer("minari_", "Minari", (), ("minari",), "[cli,data]"),
    Peer("optuna_", "Optuna", (), ("optuna",), "[train]"),
    Peer("openai_agents", "openai-agents in the same environment", ("openai-agents",), ("openai-agents",), "[cli]"),
)


def main() -> int:
    """Run the peers; returns 1 if one of them does not work."""
    parser = argparse.ArgumentParser(prog="python -m tools.peers", description=__doc__)
    parser.add_argument("peers", nargs="*", metavar="NAME", help=f"of {', '.join(each.name for each in PEERS)}; all")
    chosen = parser.parse_args().peers
    unknown = set(chosen) - {each.name for each in PEERS}
    if unknown:
        parser.error(f"there is no peer {', '.join(sorted(unknown))}")
    WORK.mkdir(exist_ok=True)
    wheel = _wheel()
    found = json.loads(DATA.read_text(encoding="utf-8")) if DATA.is_file() else {}
    for peer in PEERS:
        if not chosen or peer.name in chosen:
            print(f"{peer.title} ...", flush=True)
            found[peer.name] = _run(peer, wheel)
            for check in found[peer.name]["checks"]:
                print(f"  {check['outcome']}: {check['what']}{' - ' + check['note'] if check['note'] else ''}")
            DATA.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
            PAGE.write_text("\n".join(_page(found)) + "\n", encoding="utf-8")
    return int(any(check["outcome"] == FAILS for each in found.values() for check in each["checks"]))


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
    digest = hashlib.sha256(repr(asdict(peer)).encode() + peer.script.read_bytes())
    with ZipFile(wheel) as content:
        for name in sorted(content.namelist()):
            digest.update(name.encode() + content.read(name))
    return digest.hexdigest()[:16]


def _run(peer: Peer, wheel: Path) -> dict[str, Any]:
    folder, stamp = WORK / peer.name, _stamp(peer, wheel)
    kept = folder / "result.json"
    if kept.is_file() and (before := json.loads(kept.read_text(encoding="utf-8")))["stamp"] == stamp:
        return before
    python = folder / ("Scripts" if os.name == "nt" else "bin") / "python"
    if not python.exists():
        venv.create(folder, with_pip=True)
    pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-input"]
    result: dict[str, Any] = {"title": peer.title, "stamp": stamp, "versions": {}, "checks": []}
    try:
        subprocess.run([*pip, f"{wheel}{peer.extras}", *peer.packages], check=True, capture_output=True, text=True)
        subprocess.run([*pip, "--no-deps", "--force-reinstall", str(wheel)], check=True, capture_output=True, text=True)
    except subprocess.CalledProcessError as error:
        result["checks"].append({"what": "installation", "outcome": FAILS, "note": error.stderr[-NOTES_AT_MOST:]})
        return result
    result["versions"] = _versions(python, peer)
    result["checks"] = list(_checks(python, peer, folder))
    if all(check["outcome"] != FAILS for check in result["checks"]):
        kept.write_text(json.dumps(result), encoding="utf-8")
    return result


def _versions(python: Path, peer: Peer) -> dict[str, str]:
    code = (
        "import json, sys; from importlib.metadata import version; "
        "print(json.dumps({name: version(name) for name in sys.argv[1:]}))"
    )
    done = subprocess.run([str(python), "-c", code, *peer.shown], check=True, capture_output=True, text=True)
    return dict(json.loads(done.stdout))


def _checks(python: Path, peer: Peer, folder: Path) -> Iterator[dict[str, str]]:
    environment = {**os.environ, "CPS_ENVS_QUIET": "1", "PYTHONPATH": str(HERE / "checks"), "CUDA_VISIBLE_DEVICES": ""}
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        environment.pop(name, None)
    work = folder / "work"
    work.mkdir(exist_ok=True)
    try:
        done = subprocess.run(
            [str(python), str(peer.script)],
            cwd=work,
            env=environment,
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        printed = error.stdout or b""
        yield from _reports(printed.decode() if isinstance(printed, bytes) else printed)
        yield {"what": "the rest", "outcome": FAILS, "note": f"not finished after {LIMIT_S:.0f} s"}
        return
    yield from _reports(done.stdout)
    if done.returncode:
        yield {"what": "the script", "outcome": FAILS, "note": " ".join(done.stderr[-NOTES_AT_MOST:].split())}


def _reports(printed: str) -> Iterator[dict[str, str]]:
    """The outcomes among what the checks printed."""
    yield from (json.loads(line) for line in printed.splitlines() if line.startswith('{"what"'))


def _page(found: dict[str, Any]) -> Iterator[str]:
    yield HEAD
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
