"""What somebody hands in: a folder `leaderboard/VERSION/TRACK/NAME` that holds a policy, and no number about it.

It is one of three forms, which the names of its files tell:

- network: `policy.safetensors` with weights and `policy.json`, their card; neither runs code;
- registered: `entry.json`, `{"policy": "contested"}`, a policy of this package;
- code: `policy.py` with a function `policy(spec)`.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from safetensors import SafetensorError
from safetensors.numpy import load as from_bytes

from cps_agents.errors import CommandError
from cps_agents.scoring.tracks import Track, find_track
from cps_agents.zoo.card import SHIPPED, Card
from cps_agents.zoo.files import START, load, read_pair, shipped_names
from cps_agents.zoo.references import ZOO, form_of, reference_to
from cps_agents.zoo.wired import wired_policy
from cps_envs.core.documents import read_bytes, read_entry
from cps_envs.core.errors import ConfigurationError, UnknownNameError
from cps_envs.core.policies.lookup import parsed, policy_names
from cps_envs.core.policies.reference import Reference, texts_in
from cps_envs.registration import find_problem

NETWORK, REGISTERED, CODE = "network", "registered", "code"
FILES: Mapping[str, frozenset[str]] = {
    NETWORK: frozenset({"policy.json", "policy.safetensors"}),
    REGISTERED: frozenset({"entry.json"}),
    CODE: frozenset({"policy.py"}),
}
RESULT = "result.json"  # which the verifier writes
BESIDE = frozenset({RESULT, "README.md", ".policy.json.lock"})  # the last one is left by what writes a network
MOST_BYTES: Mapping[str, int] = {
    "policy.safetensors": 8 * 2**20,
    "policy.json": 2**20,
    "entry.json": 2**14,
    "policy.py": 2**18,
    "README.md": 2**16,
    RESULT: 2**26,
}
NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,49}")
MOST_SEEDS = 20  # training seeds of a network
MADE_OF_OTHERS = ("mixture", "trace")  # registered names that are no single policy
REMEDY = 'Write {"policy": "NAME"} with a policy that `cps-envs list` shows.'


@dataclass(frozen=True)
class Submission:
    """A folder that was read and found in order; nothing has been played."""

    folder: Path
    track: Track
    form: str  # one of `FILES`
    policy: str  # its reference; of code its source text
    digest: str  # of all files that say how it plays
    card: Card | None = None  # of networks, handed in or shipped

    @property
    def name(self) -> str:
        """Of the entry."""
        return self.folder.name


def read_submission(folder: Path) -> Submission:
    """The policy in a folder; no code of it runs.

    Raises:
        CommandError: the folder, its files or its policy are not what an entry may be.
        UnknownNameError: there is no such track or policy.
        ValueError: a file is damaged.
        OSError: a file cannot be read.
    """
    folder = folder.absolute()
    track = find_track(folder.parent.name)
    if not NAME.fullmatch(folder.name):
        raise CommandError(f"{folder}: name the folder by small letters, digits, - and _, such as my-method")
    form = _form(folder)
    data = {name: read_bytes(folder / name, MOST_BYTES[name]) for name in sorted(FILES[form])}
    digest = hashlib.sha256(b"".join(hashlib.sha256(each).digest() for each in data.values())).hexdigest()[:16]
    if form == CODE:
        return Submission(folder, track, form, _source(folder / "policy.py", data["policy.py"]), digest)
    if form == NETWORK:
        card_path = folder / "policy.json"
        here = Path.cwd()  # of a clone: the reference is the same on every machine
        reference = reference_to(folder.relative_to(here) if folder.is_relative_to(here) else folder)
        return Submission(folder, track, form, reference, digest, _network(card_path, reference, track))
    entry = read_entry(folder / "entry.json", "entry of a leaderboard", REMEDY)
    if set(entry.entries()) != {"policy"}:
        raise CommandError(f"{folder / 'entry.json'} has to have one line, the policy. {REMEDY}")
    policy = entry["policy"].text()
    card = _registered(policy, track)
    return Submission(folder, track, form, policy, digest, card)


def _form(folder: Path) -> str:
    """The form that the files of a folder have together.

    Raises:
        CommandError: there are other files, too few, links, or too large ones.
    """
    if folder.is_symlink() or not folder.is_dir():
        raise CommandError(f"{folder} is no folder: an entry is a folder leaderboard/VERSION/TRACK/NAME")
    for path in folder.iterdir():
        if path.is_symlink() or not path.is_file():
            raise CommandError(f"{path} is a link or a folder: an entry holds plain files only")
    found = {path.name for path in folder.iterdir()}
    form = next((form for form, names in FILES.items() if names == found - BESIDE), None)
    if form is None:
        shown = ", ".join(sorted(found - BESIDE)) or "nothing"
        raise CommandError(
            f"{folder} holds {shown}: an entry is policy.json and policy.safetensors (`cps-envs zoo import` and "
            "`cps-envs zoo add` write them), or entry.json alone, or policy.py alone"
        )
    return form


def _source(path: Path, data: bytes) -> str:
    try:
        text = data.decode("utf-8")
        tree = ast.parse(text, path.name)
    except (ValueError, SyntaxError, RecursionError) as error:
        raise CommandError(f"{path} is no Python code: {error}") from error
    if not any(getattr(node, "name", "") == "policy" for node in tree.body):
        raise CommandError(f"{path} has no function policy(spec): define one that returns an object with `predict`")
    return text


def _network(card_path: Path, reference: str, track: Track) -> Card:
    """The card of a network that fits the track, all of its training seeds.

    Raises:
        CommandError: it does not fit.
        ValueError: the files are damaged.
    """
    card, data = read_pair(card_path)
    if (card.problem, card.role) != (track.problem, track.role):  # before the problem is looked up, which may be code
        raise CommandError(
            f"{card_path} is of the {card.role} of {card.problem[:40]}, and {track.name} is another role"
        )
    if not card.weights:
        raise CommandError(f"{card_path} does not name the hash of its weights: write it with `cps-envs zoo import`")
    if not 1 <= len(card.seeds) <= MOST_SEEDS:
        raise CommandError(f"{card_path} has {len(card.seeds)} training seeds: at most {MOST_SEEDS} may play")
    _check_form(str(card_path), reference, track)
    try:
        tensors = from_bytes(data)
    except SafetensorError as error:
        raise CommandError(f"{card_path.with_suffix('.safetensors')} holds no safetensors: {error}") from error
    known = {f"{prefix}{seed}/" for seed in card.seeds for prefix in ("", START)}
    if odd := [name for name in tensors if not any(name.startswith(each) for each in known)]:
        raise CommandError(f"{card_path}: the weights hold {odd[0][:40]!r}, which is of none of its training seeds")
    spec = find_problem(track.problem).game(track.venue.config, 1).spec(track.role)
    contents: dict[bytes, str] = {}
    for seed in card.seeds:
        _, network = load(card_path, int(seed))
        try:
            wired_policy(spec, card, network)
        except (ConfigurationError, UnknownNameError) as error:
            raise CommandError(f"{card_path} does not fit {track.name}: {error}") from error
        content = b"".join(array.tobytes() for _, array in sorted(network.tensors().items()))
        if content in contents:
            raise CommandError(
                f"{card_path}: training seeds {contents[content]} and {seed} are the same network: hand it in once"
            )
        contents[content] = seed
    return card


def _registered(policy: str, track: Track) -> Card | None:
    """Check that a reference names one policy of this package; the card of a shipped network.

    Raises:
        CommandError: it names something else.
    """
    tree = parsed(policy)
    if tree.source == ZOO and tree.name in shipped_names():
        _check_options(tree, ("seed",))
        return _network(SHIPPED / f"{tree.name}.json", policy, track)
    names = set(policy_names(track.problem, track.role)) - set(MADE_OF_OTHERS)
    if tree.source or tree.policies or tree.title not in names:
        raise CommandError(
            f"entry.json names {policy[:60]!r}: it may name a policy of the {track.role} of {track.problem} that this "
            "package ships, such as none or zoo:NAME; hand in other networks as weights, and other code as policy.py"
        )
    if any("/" in text or "\\" in text or "." in text for text in texts_in(list(tree.options.values()))):
        raise CommandError(f"entry.json: an option of {tree.title!r} names a file, and an entry may not read any")
    return None


def _check_options(tree: Reference, allowed: tuple[str, ...]) -> None:
    odd = sorted(set(tree.options) - set(allowed))
    if odd:
        raise CommandError(f"entry.json: {tree.title} may have the option {', '.join(allowed)} only, not {odd[0]!r}")


def _check_form(name: str, reference: str, track: Track) -> None:
    """That a network sees and acts as the track says, and not as its card says.

    Raises:
        CommandError: it was trained in another form.
    """
    form = form_of(reference, track.venue.config)
    if form:
        changed = ", ".join(f"{field} = {value!r}" for field, value in form.items())
        raise CommandError(
            f"{name} was trained with {changed}, and {track.name} is played as it is: train it in preset learning"
        )
