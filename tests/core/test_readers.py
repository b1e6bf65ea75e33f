"""Files from outside are read in one place, `cps_envs/core/documents.py`; every other reader is named here."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
READS = re.compile(
    r"json\.loads?\(|\.read_text\(|\.read_bytes\(|np\.(load|genfromtxt)\(|csv\.(reader|DictReader)|pickle\.load"
)
OWN = re.compile(r"files\(|to_json\(|json\.dumps\(|rows\.append")  # data of the package, and text just written
SHIPPED = ("cps_envs", "baselines/cps_baselines", "agents/cps_agents", "paper/cps_paper")
ELSEWHERE = {
    "agents/cps_agents/arena/store.py": "hashes of the package's own sources",
    "agents/cps_agents/zoo/code.py": "hashes of code of one's own, which is not run",
    "agents/cps_agents/zoo/lookup.py": "statistics of VecNormalize, with the user's consent",
    "agents/cps_agents/machine.py": "/proc/cpuinfo",
    "agents/cps_agents/scoring/apart.py": "lines of the process that plays somebody's code, each value checked",
    "agents/cps_agents/scoring/server.py": "lines of the process that started it",
    "agents/cps_agents/commands/certify.py": "text that the program made",
    "agents/cps_agents/report/sources.py": "lines of text that documents.py has read",
    "paper/cps_paper/printed/tables.py": "data of the package",
    "baselines/cps_baselines/hvac/calibrated.py": "data of the package",
    "baselines/cps_baselines/disbanding/string_controller.py": "data of the package",
    "baselines/cps_baselines/disbanding/feedback.py": "data of the package",
    "paper/cps_paper/verdicts.py": "data of the package",
    "baselines/cps_baselines/rogue/informed.py": "data of the package",
    "baselines/cps_baselines/rogue/switching.py": "data of the package",
    "baselines/cps_baselines/searched.py": "data of the package",
    "cps_envs/core/conformance/copies.py": "what it has pickled itself",
    "cps_envs/core/conformance/transport.py": "what a child process of a test prints",
    "cps_envs/core/compute/kernel_cache.py": "the package's own sources",
    "cps_envs/core/declare/traces.py": "lines of text that documents.py has read",
    "cps_envs/hvac/weather_files.py": "lines of text that documents.py has read",
    "cps_envs/core/learning/scaling.py": "data of the package",
    "cps_envs/fdi/optima.py": "data of the package",
}


def test_no_other_module_reads_files_from_outside() -> None:
    found = set()
    for folder in SHIPPED:
        for path in (ROOT / folder).rglob("*.py"):
            name = path.relative_to(ROOT).as_posix()
            if name == "cps_envs/core/documents.py":
                continue
            lines = path.read_text(encoding="utf-8").splitlines()
            if any(READS.search(line) and not OWN.search(line) for line in lines):
                found.add(name)
    assert sorted(found - set(ELSEWHERE)) == []


def test_only_what_security_names_opens_a_port_or_sends_something() -> None:
    reaching = re.compile(r"^\s*(import|from) (http|socket|socketserver|urllib\.request|requests)\b", re.M)
    found = {
        path.relative_to(ROOT).as_posix(): {word for _, word in reaching.findall(path.read_text(encoding="utf-8"))}
        for folder in SHIPPED
        for path in (ROOT / folder).rglob("*.py")
    }
    assert {name: words for name, words in found.items() if words} == {
        "agents/cps_agents/report/report.py": {"http"},
    }
    security = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    assert all(said in security for said in ("report --serve", "127.0.0.1"))
