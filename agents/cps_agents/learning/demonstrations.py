"""What a teacher does: observations and actions of episodes that an analytic policy plays or comments on.

Opponents and their teachers stand side by side, and so do the episodes that choose the best network of a run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_agents.errors import CommandError
from cps_agents.learning.recipe import Recipe
from cps_envs.core.game import Game
from cps_envs.core.lookup import PolicyReference
from cps_envs.core.mixture import Mixture
from cps_envs.core.play import play_episodes
from cps_envs.core.policy import AnalyticPolicy, Generators, Knowledge, Policy, RoleSpec, State, ask, begun
from cps_envs.core.seeds import VALIDATION
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, BoolArray, IntArray, Observation, Role, other
from cps_envs.registration import find_problem


class Dealt(Mixture):
    """Plays by its policies in turn, the k-th episode of those that begin together by the k-th one.

    Two of them as both roles of a match pair off: who meets the k-th opponent has the k-th teacher.
    """

    def draw(self, generators: Generators) -> Array:
        """Which policy (B,) plays each episode."""
        return np.arange(len(generators)) % len(self.policies)


def teacher_of(recipe: Recipe, game: Game) -> Policy:
    """The recipe's teacher, or its teachers in the order of their opponents."""
    if recipe.teachers:
        return Dealt(game.spec(recipe.role), list(recipe.teachers.values()))
    return find_problem(recipe.problem).policy(recipe.teacher, game, recipe.role)


def opponent_of(recipe: Recipe, game: Game) -> PolicyReference:
    """Whom the recipe plays: its opponents in turn where each has a teacher, else its opponent or the preset's."""
    rival = other(recipe.role)
    if recipe.teachers:
        return Dealt(game.spec(rival), list(recipe.teachers))
    return recipe.opponent or find_problem(recipe.problem).opponents[recipe.preset][rival]


RENEWED = 0.1  # of the noise, at a decision


@dataclass(frozen=True)
class Demonstrations:
    """N decisions of single agents."""

    observations: Array  # (N, n)
    actions: Array  # (N, ...)
    masks: BoolArray | None  # (N, k)


def join(first: Demonstrations | None, second: Demonstrations) -> Demonstrations:
    """Both, one after the other."""
    if first is None:
        return second
    masks = None
    if first.masks is not None and second.masks is not None:
        masks = np.concatenate([first.masks, second.masks])
    return Demonstrations(
        np.concatenate([first.observations, second.observations]),
        np.concatenate([first.actions, second.actions]),
        masks,
    )


def demonstrate(recipe: Recipe, seeds: Sequence[int], student: Policy | None = None) -> Demonstrations:
    """The teacher's answers in one episode per seed; the student, if there is one, acts in its place."""
    found: Demonstrations | None = None
    for commented in comment(recipe, seeds, student):
        found = join(found, commented.demonstrations())
    assert found is not None
    return found


def comment(recipe: Recipe, seeds: Sequence[int], student: Policy | None = None) -> Iterator[Commented]:
    """The comments on one episode per seed, variation by variation of the recipe."""
    problem, rival = find_problem(recipe.problem), other(recipe.role)
    for config, share in divided(recipe, seeds):
        game = problem.game(config, 1)
        commented = Commented(game.spec(recipe.role), teacher_of(recipe, game), student, recipe)
        players: dict[Role, Any] = {recipe.role: commented, rival: opponent_of(recipe, game)}
        play_episodes(problem, config, players, share)
        yield commented


def divided(recipe: Recipe, seeds: Sequence[int]) -> Iterator[tuple[Any, Sequence[int]]]:
    """The configurations of a recipe's variations, each with its share of the seeds."""
    variations = recipe.variations or ({},)
    for place, variation in enumerate(variations):
        share = seeds[place :: len(variations)]
        if share:
            yield find_problem(recipe.problem).config(recipe.preset, {**recipe.overrides, **variation}), share


class Commented(AnalyticPolicy):
    """Writes down what a teacher would do at each observation; the student or else the teacher acts.

    What the teacher plays is disturbed by `teacher_noise`, what is written down is not.

    Raises:
        CommandError: noise for discrete actions.
    """

    masked = True

    def __init__(self, spec: RoleSpec, teacher: Policy, student: Policy | None, recipe: Recipe) -> None:
        super().__init__(spec)
        if recipe.teacher_noise and not isinstance(spec.action_space, spaces.Box):
            raise CommandError(f"teacher_noise is for continuous actions, not {spec.action_space}")
        self._teacher, self._student, self._hold = teacher, student, recipe.hold
        self._deviation, self._generator = recipe.teacher_noise, np.random.default_rng(0)  # until `begin`
        self._noise: Array | None = None
        self._age = 0  # all environments start together and are asked together
        self._held: Array | None = None
        self._seen: list[tuple[Array, Array, BoolArray | None, IntArray]] = []
        self.decentralised = recipe.swarm
        self.privileged = getattr(teacher, "privileged", frozenset())

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The states of teacher and student, each as an object per environment."""
        if self._deviation:
            self._generator = np.random.default_rng(generators[0].integers(2**63))
        states = np.empty((len(generators), 2), object)
        for column, player in enumerate((self._teacher, self._student)):
            _spread(states, column, None if player is None else begun(player, generators, knowledge))
        return states, np.arange(len(generators))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """What the student plays, or the teacher with noise."""
        states = state[0].copy()
        actions, own = ask(self._teacher, seen, _joined(states, 0))
        _spread(states, 0, own)
        due = self._age % self._hold == 0
        self._age += 1
        if due:
            self._note(seen.observation, seen.team, np.asarray(actions), seen.masks, state[1])
        if self._student is not None:
            actions, own = ask(self._student, seen, _joined(states, 1))
            _spread(states, 1, own)
        elif not due and self._held is not None:
            actions = self._held
        elif self._deviation:
            actions = self._disturbed(np.asarray(actions))
        self._held = np.asarray(actions)
        return self._held, (states, state[1])

    def _disturbed(self, actions: Array) -> Array:
        """Actions with noise, of which an entry changes now and then: what lasts shows in the state."""
        fresh = self._generator.normal(0.0, self._deviation, actions.shape)
        changing = self._generator.random(actions.shape) < RENEWED
        self._noise = fresh if self._noise is None else np.where(changing, fresh, self._noise)
        disturbed: Array = np.clip(actions + self._noise, -1.0, 1.0)
        return disturbed

    def _note(
        self, observation: Array, team: Observation | None, actions: Array, masks: BoolArray | None, episodes: IntArray
    ) -> None:
        if team is not None:
            size, agents = team.shape[:2]
            observation, actions = team.reshape(-1, team.shape[-1]), actions.reshape(size * agents, -1)
            masks = None if masks is None else masks.reshape(size * agents, -1)
            episodes = (episodes[:, np.newaxis] * agents + np.arange(agents)).reshape(-1)
        self._seen.append((observation.copy(), actions.copy(), None if masks is None else masks.copy(), episodes))

    def decisions(self) -> list[tuple[Array, Array, BoolArray | None, IntArray]]:
        """What has been seen, decision by decision: observations, actions, masks and the episodes of the rows."""
        return self._seen

    def demonstrations(self) -> Demonstrations:
        """All that has been seen."""
        observations, actions, masks, _ = zip(*self._seen, strict=True)
        known = None if masks[0] is None else np.concatenate(masks)
        return Demonstrations(np.concatenate(observations), np.concatenate(actions), known)


def _spread(states: Array, column: int, state: State | None) -> None:
    for b in range(len(states)):
        states[b, column] = None if state is None else tuple(array[b : b + 1] for array in state)


def _joined(states: Array, column: int) -> State | None:
    rows = states[:, column]
    return None if rows[0] is None else tuple(np.concatenate(parts) for parts in zip(*rows, strict=True))


def validate(recipe: Recipe, policy: Policy) -> dict[str, Array]:
    """What the validation episodes of all variations of a recipe end with, (B,) each."""
    problem = find_problem(recipe.problem)
    found = []
    for config, seeds in divided(recipe, VALIDATION[: recipe.evaluation_episodes]):
        opponent = opponent_of(recipe, problem.game(config, 1))
        found.append(play_episodes(problem, config, {recipe.role: policy, other(recipe.role): opponent}, seeds))
    return {name: np.concatenate([each[name] for each in found]) for name in found[0]}
