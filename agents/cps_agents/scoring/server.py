"""`python -m cps_agents.scoring.server`: runs code of somebody else for `apart`, by frames over its standard pipes."""

from __future__ import annotations

import json
import os
import sys
from typing import IO, Any

import numpy as np

from cps_agents.arena.venue import Venue
from cps_envs.core.policies.policy import is_decentralised, privileged_of, takes_masks, takes_mode
from cps_envs.core.policies.state import put, take
from cps_envs.core.types import State
from cps_envs.registration import find_problem

MOST_CPU_S = 3600  # of a batch of episodes
LONGEST = 1500  # characters of an error


def main() -> None:
    """Make the policy, then answer until nobody asks."""
    into, out = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDWR), 0)
    os.dup2(0, 1)  # what the code prints is no answer
    try:
        head, data = _frame(into)
        spec = find_problem(head["problem"]).game(Venue(head["problem"]).config, 1).spec(head["role"])
        _limit()
        policy = _policy(data.decode(), spec)
        _say(out, {"ready": True})
        _serve(policy, into, out)
    except EOFError:
        return
    except BaseException as error:
        _say(out, {"error": f"{type(error).__name__}: {error}"[:LONGEST]})


def _limit() -> None:
    """No more processes, no core files, and so much CPU time."""
    import resource

    resource.setrlimit(resource.RLIMIT_CPU, (MOST_CPU_S, MOST_CPU_S))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_NPROC, (0, 0))


def _policy(source: str, spec: Any) -> Any:
    """What the code makes.

    Raises:
        TypeError: it is no policy, or one that has to be told what nobody tells here.
    """
    names: dict[str, Any] = {"__name__": "policy", "__file__": "policy.py"}
    exec(compile(source, "policy.py", "exec"), names)
    policy = names["policy"](spec)
    if not hasattr(policy, "predict"):
        raise TypeError("policy(spec) returned an object without predict(observation, state, episode_start, ...)")
    if told := privileged_of(policy):
        raise TypeError(f"it wants to be told {' and '.join(sorted(told))}, and an entry sees its observations only")
    if is_decentralised(policy):
        raise TypeError("it is decentralised: hand it in as a network, or let it decide from the role's observation")
    return policy


def _serve(policy: Any, into: IO[bytes], out: IO[bytes]) -> None:
    """Answer questions; the state of the episodes stays here."""
    state: State | None = None
    masked, episodes = takes_masks(policy), 0
    while True:
        head, data = _frame(into)
        parts, place = {}, 0
        for name, (kind, shape) in head["parts"].items():
            size = int(np.prod(shape)) * np.dtype(kind).itemsize
            parts[name] = np.frombuffer(data[place : place + size], kind).reshape(shape)
            place += size
        rows = parts["rows"]
        episodes = episodes or len(rows)  # all of them begin together
        extras = {"action_masks": parts["masks"]} if masked and "masks" in parts else {}
        mode = takes_mode(policy, False)
        actions, own = policy.predict(parts["observation"], take(state, rows), parts["start"], mode, **extras)
        state = put(state, rows, own, episodes)
        actions = np.asarray(actions)
        kind = {"b": "b1", "i": "i8", "u": "i8", "f": "f8"}.get(actions.dtype.kind)
        if kind is None:
            raise TypeError(f"predict returned actions of type {actions.dtype}")
        _say(out, {"kind": kind, "shape": list(actions.shape)}, np.ascontiguousarray(actions, kind).tobytes())


def _frame(into: IO[bytes]) -> tuple[dict[str, Any], bytes]:
    line = into.readline()
    if not line:
        raise EOFError
    head = json.loads(line)  # of the process that started this one
    return head, into.read(head["bytes"])


def _say(out: IO[bytes], head: dict[str, Any], data: bytes = b"") -> None:
    out.write(json.dumps(head).encode() + b"\n" + data)
    out.flush()


if __name__ == "__main__":
    sys.dont_write_bytecode = True
    main()
