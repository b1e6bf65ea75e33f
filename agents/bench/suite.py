"""What `cps-envs bench` measures, one item after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from agents.bench.clock import calls_per_s
from agents.bench.faces import CARTPOLE, NUM_ENVS, Face, cartpole, faces
from agents.bench.kernel import face_overhead_us, physics_per_s
from cps_envs.core.problem import Problem
from cps_envs.core.types import ROLES

Report = Callable[[int, int, str], None]  # items done, items in all, what comes next
KERNEL_LANES = (1, 64)
FACE_TARGET_US = 10.0  # what the single environment may add to a decision


@dataclass(frozen=True)
class Speed:
    """One face's rates per CPU second."""

    env: str
    form: str
    envs: int
    steps_per_s: float  # environment steps; a step of a vector environment counts once per environment
    decisions_per_s: float  # of the roles played from outside
    work_per_s: float  # units of physics; 0 where the problem names none
    unit: str
    cartpole_ratio: float  # steps per second over those of CartPole in the same form


@dataclass(frozen=True)
class Target:
    """Something that the project promises."""

    what: str
    measured: float
    wanted: str
    met: bool


def measure_all(problems: Sequence[Problem], seconds: float, report: Report) -> dict[str, list[Any]]:
    """Everything, with about `seconds` of CPU for each item: faces, physics alone, what faces add, targets."""
    listed: list[tuple[Face, str]] = [(face, "") for face in cartpole()]
    listed += [(face, _unit(problem)) for problem in problems for face in faces(problem)]
    total = len(listed) + len(problems) * (len(KERNEL_LANES) + len(ROLES))
    speeds: list[Speed] = []
    for face, unit in listed:
        report(len(speeds), total, f"{face.env} {face.form} {face.envs}")
        speeds.append(_speed(face, unit, seconds, speeds))
    done, physics, added = len(speeds), [], []
    for problem in problems:
        report(done, total, f"{problem.name}: physics alone")
        physics += _physics(problem, seconds) if problem.work else []
        report(done := done + len(KERNEL_LANES), total, f"{problem.name}: what the face adds")
        added += _added(problem, seconds)
        report(done := done + len(ROLES), total, "")
    return {"speeds": speeds, "physics": physics, "added": added, "targets": _targets(problems, speeds, physics, added)}


def _unit(problem: Problem) -> str:
    return problem.work.unit if problem.work else ""


def _speed(face: Face, unit: str, seconds: float, before: Sequence[Speed]) -> Speed:
    steps = face.envs * calls_per_s(face.start(), seconds)
    form = "single" if face.form == "parallel" else face.form
    yardstick = [speed for speed in before if (speed.env, speed.form, speed.envs) == (CARTPOLE, form, face.envs)]
    ratio = steps / yardstick[0].steps_per_s if yardstick else 1.0
    decisions, work = steps * face.decisions, steps * face.work
    return Speed(face.env, face.form, face.envs, steps, decisions, work, unit, ratio)


def _physics(problem: Problem, seconds: float) -> list[dict[str, Any]]:
    return [
        {
            "problem": problem.name,
            "envs": envs,
            "unit": _unit(problem),
            "work_per_s": physics_per_s(problem, envs, seconds),
        }
        for envs in KERNEL_LANES
    ]


def _added(problem: Problem, seconds: float) -> list[dict[str, Any]]:
    rows = []
    for role in ROLES:
        added, alone = face_overhead_us(problem, role, seconds)
        rows.append({"env": problem.env_id(role), "added_us": added, "game_us": alone})
    return rows


def _targets(
    problems: Sequence[Problem],
    speeds: Sequence[Speed],
    physics: Sequence[dict[str, Any]],
    added: Sequence[dict[str, Any]],
) -> list[Target]:
    wanted = {problem.name: problem.work.target_per_s for problem in problems if problem.work}
    targets = []
    for row in physics:
        what = f"{row['problem']}, physics alone, {row['envs']} environments: {row['unit']} per CPU second"
        targets += _at_least(what, row["work_per_s"], wanted[row["problem"]])
    # The attacker's: its opponent is `none`, so that no policy is timed with it.
    vector = {problem.env_id(role): problem.work for problem in problems if problem.work for role in ROLES[:1]}
    for speed in speeds:
        if speed.env in vector and speed.envs == max(NUM_ENVS):
            what = f"{speed.env}, vector, {speed.envs} environments: {speed.unit} per CPU second"
            targets += _at_least(what, speed.work_per_s, vector[speed.env].vector_target_per_s)
    for row in added:
        what = f"{row['env']}, single: microseconds that the face adds to a decision"
        targets.append(Target(what, row["added_us"], f"below {FACE_TARGET_US:g}", row["added_us"] < FACE_TARGET_US))
    return targets


def _at_least(what: str, measured: float, least: float) -> list[Target]:
    return [Target(what, measured, f"at least {least:,.0f}", measured >= least)] if least > 0 else []
