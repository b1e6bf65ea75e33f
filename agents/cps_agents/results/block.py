"""An examination as plain data; each problem declares its blocks in `agents/cps_agents/results/<problem>.py`.

Whom learned policies are compared with, and what those without a declared target have to reach.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from cps_agents.arena.challenge import Challenge, able, short_name, usual
from cps_agents.catalogue import policies
from cps_agents.learning.recipe import SEARCH
from cps_agents.recipes.finding import RECIPES
from cps_agents.zoo.references import card_of, is_missing, is_trained
from cps_baselines.arena import Contestant, Venue
from cps_envs import find_problem
from cps_envs.core.lookup import NEED_OPTIONS
from cps_envs.core.types import ROLES, Role, other


@dataclass(frozen=True)
class Bar:
    """What a learned policy has to pass: a number, or baselines in the same episodes.

    `every` asks to beat all baselines that the table shows. More is asked of attackers and less of defenders, unless
    `less` says otherwise. The whole interval has to be on the right side, or with `by_mean` the mean.
    """

    beat: tuple[str, ...] = ()  # contestants, each of them
    every: bool = False
    value: float | None = None
    factor: float = 1.0  # of what the contestants reach
    metric: str = ""  # the row's if empty
    less: bool | None = None
    or_equal: bool = False
    by_mean: bool = False
    of: tuple[str, ...] = ()  # the learned contestants that it is for; all if empty


@dataclass(frozen=True)
class Row:
    """A line of a table: one challenge, or several that count equally."""

    title: str
    challenges: tuple[Challenge, ...]
    bars: tuple[Bar, ...] | None = None  # the block's if None; () shows the row without judging it
    metric: str = ""  # the block's if empty
    per: str = ""  # a metric of the same episode that it is divided by; the block's if empty
    bound: str = ""  # what is known to be the best possible, in words
    best_known: float = 0.0  # what the best of all searches reached, of which shares are shown; 0: nothing is known
    without: tuple[str, ...] = ()  # baselines that cannot play it
    headline: bool = False  # stands for the block in summaries; the first judged row if none does


@dataclass(frozen=True)
class Block:
    """One target with everything that is played for it."""

    name: str  # short, lower case
    title: str
    target: str  # what has to be reached, in words
    problem: str
    role: Role
    metric: str
    learned: tuple[Contestant, ...]
    baselines: tuple[Contestant, ...]
    rows: tuple[Row, ...]
    bars: tuple[Bar, ...] = ()
    per: str = ""  # a metric of the same episode that it is divided by
    form: str = "{:.2f}"
    unit: str = ""
    shown: tuple[str, ...] = ()  # further metrics to print beside
    notes: tuple[str, ...] = ()
    left_out: Mapping[str, str] = field(default_factory=dict)  # registered policies that do not play, with the reason

    @property
    def contestants(self) -> tuple[Contestant, ...]:
        """The learned ones, then the baselines."""
        return (*self.learned, *self.baselines)

    def bars_of(self, row: Row) -> tuple[Bar, ...]:
        """What a row is judged by."""
        return self.bars if row.bars is None else row.bars

    def rivals_of(self, bar: Bar) -> tuple[str, ...]:
        """The contestants that a bar asks to beat."""
        return tuple(each.name for each in self.baselines if not each.optimum) if bar.every else bar.beat

    def metric_of(self, row: Row) -> str:
        """What a row shows."""
        return row.metric or self.metric

    def per_of(self, row: Row, metric: str) -> str:
        """What a metric of a row is divided by; nothing if empty."""
        return (row.per or self.per) if metric == self.metric else ""


EPISODES = 50


def derived(name: str, policies: Sequence[str]) -> Iterator[Block]:
    """A block for each role of a problem that some of these trained policies play."""
    problem = find_problem(name)
    for role in ROLES:
        cards = {policy: card_of(policy) for policy in policies}
        mine = [each for each, card in cards.items() if card and (card.problem, card.role) in _names(name, role)]
        if mine:
            yield Block(
                name=f"{problem.name}-{role}",
                title=f"{problem.name} {role}",
                target=f"better than every other {role}, in each preset and against each opponent.",
                problem=name,
                role=role,
                metric="return",
                learned=tuple(Contestant(short_name(policy), policy) for policy in mine),
                baselines=tuple(_own(name, role)),
                rows=tuple(_rows(name, role)),
                bars=(Bar(every=True),),
                unit=problem.unit,
            )


def _names(name: str, role: Role) -> tuple[tuple[str, Role], ...]:
    return (name, role), (find_problem(name).name, role)


def _own(name: str, role: Role) -> Iterator[Contestant]:
    """The policies that presets name without registering them; registered ones join every block."""
    usual_ones = dict.fromkeys(each[role] for each in find_problem(name).opponents.values())
    yield from (Contestant(each) for each in usual_ones if ":" in each)


def _rows(name: str, role: Role) -> Iterator[Row]:
    rival = other(role)
    for preset in find_problem(name).presets:
        venue = Venue(name, preset)
        for each in able(venue, rival, usual(venue, rival)):
            yield Row(f"{preset}, against {each.name}", (Challenge(venue, role, each.reference, EPISODES),))


def completed(block: Block) -> Block:
    """The block with every registered policy of its role and every teacher of its learned policies as a baseline.

    A teacher that is one of the learned policies stays one. Who learned from a trained policy has to beat it in every
    row that is judged. Policies that know more than they observe play only where a block lists them.
    """
    full = replace(block, baselines=(*block.baselines, *_registered(block), *_teachers(block)))
    return replace(full, rows=tuple(replace(row, bars=(*full.bars_of(row), *_above(full, row))) for row in full.rows))


def _above(block: Block, row: Row) -> Iterator[Bar]:
    """Bars for those who learned from a trained policy, where the row is judged and does not ask for it already."""
    bars = block.bars_of(row)
    for each in block.learned if bars else ():
        teacher = trained_teacher_of(block, each)
        asked = {name for bar in bars if not bar.of or each.name in bar.of for name in block.rivals_of(bar)}
        if teacher is not None and teacher.name not in asked:
            yield Bar(beat=(teacher.name,), of=(each.name,))


def trained_teacher_of(block: Block, learned: Contestant) -> Contestant | None:
    """The contestant of a block that is the trained policy which another one learned from."""
    teacher = teacher_of(learned)
    return next((each for each in block.contestants if is_trained(teacher) and each.reference == teacher), None)


def starts_at(learned: Contestant, other: Contestant) -> bool:
    """Whether each training seed of a searched policy started from the same training seed of the other one."""
    if is_missing(other.reference) or not is_trained(other.reference) or teacher_of(learned) != other.reference:
        return False
    mine, theirs = card_of(learned.reference), card_of(other.reference)
    return mine is not None and theirs is not None and mine.algorithm == SEARCH and [*mine.seeds] == [*theirs.seeds]


def _registered(block: Block) -> Iterator[Contestant]:
    listed = {each.reference.partition("?")[0] for each in block.baselines}
    for entry in policies(find_problem(block.problem), block.role):
        wanted = not entry.privileged and entry.name not in NEED_OPTIONS
        if wanted and entry.name not in listed and entry.name not in block.left_out:
            taken = entry.name in {each.name for each in block.contestants}
            yield Contestant(f"analytic {entry.name}" if taken else entry.name, entry.name)


def _teachers(block: Block) -> Iterator[Contestant]:
    listed = {each.reference for each in block.contestants}
    for each in block.learned:
        teacher = teacher_of(each)
        if teacher and teacher not in listed and teacher not in {found.reference for found in _registered(block)}:
            yield Contestant(f"teacher of {each.name}", teacher, f"teacher: {teacher}")


def teacher_of(learned: Contestant) -> str:
    """The reference of the policy that a shipped policy was first shown; empty if there was none."""
    card = None if is_missing(learned.reference) else card_of(learned.reference)
    recipe = RECIPES.get(card.name) if card is not None else None
    return recipe.teacher if recipe is not None else ""
