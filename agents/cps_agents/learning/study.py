"""A study of Optuna over the knobs of a recipe."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from cps_agents.errors import CommandError
from cps_agents.learning.learner import learn
from cps_agents.learning.recipe import SHARED, Recipe, changed, knobs_of
from cps_agents.learning.run import TrainingJob
from cps_agents.progress import Progress
from cps_baselines.workers import Workers
from cps_envs.core.documents import typed

if TYPE_CHECKING:
    import optuna

USUAL: Mapping[str, str] = {  # ranges of our own PPO
    "learning_rate": "1e-4:1e-2:log",
    "gae_lambda": "0.9:1.0",
    "clip_range": "0.1:0.3",
    "entropy_bonus": "1e-6:0.03:log",
    "hidden": "[32,32]|[64,64]|[128,128]",
}


class Tried(NamedTuple):
    """A finished trial of a study: its values and its score."""

    number: int
    score: float  # mean over the training seeds, on validation seeds; the higher the better for the role
    values: dict[str, Any]


def usual_ranges(recipe: Recipe) -> dict[str, str]:
    """What usually matters for the recipe's algorithm.

    Raises:
        CommandError: nothing is known about it.
    """
    if recipe.algorithm != SHARED:
        raise CommandError(f"name what to search for {recipe.algorithm}: add --range KNOB=LOW:HIGH")
    return dict(USUAL)


@dataclass(frozen=True)
class Study:
    """Recipe, ranges by knob, training seeds of a trial, where it is kept, and the sampler's seed."""

    recipe: Recipe
    ranges: Mapping[str, str]
    seeds: int
    folder: Path
    sampler_seed: int = 0

    def __post_init__(self) -> None:
        for knob, text in self.ranges.items():
            changed(self.recipe, {knob: first_value(knob, text, getattr(self.recipe, knob, None))})

    @property
    def path(self) -> Path:
        """The journal of all trials."""
        return self.folder / "study.log"

    def run(self, trials: int, workers: int) -> list[Tried]:
        """Do what is missing of so many trials; returns all finished ones.

        Raises:
            CommandError: the folder holds a study of something else, or no trial has ended well.
        """
        study = self.open()
        self._check_same(study)
        done = finished(study)
        with Progress(f"tune {self.recipe.name}", trials) as progress, Workers(workers) as pool:
            progress.update(len(done), "kept from before")
            while len(done) < trials:
                asked = [self._ask(study) for _ in range(min(workers, trials - len(done)))]
                for trial, outcome in pool.run(_train, asked):
                    self._tell(study, trial.number, outcome, progress)
                before, done = done, finished(study)
                if len(done) == len(before):
                    raise CommandError(f"none of the last {len(asked)} trials ended well: see the messages above")
                progress.update(len(done), f"best {max(row.score for row in done):.4g}")
        return done

    def _ask(self, study: optuna.Study) -> Trial:
        trial = study.ask()
        present = self.recipe
        values = {knob: suggest(trial, knob, text, getattr(present, knob)) for knob, text in self.ranges.items()}
        trial.set_user_attr("values", values)
        return Trial(trial.number, values, self)

    def _tell(self, study: optuna.Study, number: int, outcome: float | str, progress: Progress) -> None:
        from optuna.trial import TrialState

        if isinstance(outcome, str):
            study.tell(number, state=TrialState.FAIL)
            progress.say(f"Trial {number} failed: {outcome}")
        else:
            study.tell(number, outcome)

    def open(self) -> optuna.Study:
        """The study on disk, new if there is none."""
        import optuna
        from optuna.storages import JournalStorage
        from optuna.storages.journal import JournalFileBackend

        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self.folder.mkdir(parents=True, exist_ok=True)
        storage = JournalStorage(JournalFileBackend(str(self.path)))
        study = optuna.create_study(storage=storage, study_name="knobs", direction="maximize", load_if_exists=True)
        study.sampler = optuna.samplers.TPESampler(seed=self.sampler_seed + len(study.trials))
        return study

    def _check_same(self, study: optuna.Study) -> None:
        mine = {"recipe": knobs_of(self.recipe), "ranges": dict(self.ranges), "seeds": self.seeds}
        kept = study.user_attrs.get("subject")
        if kept is None:
            study.set_user_attr("subject", mine)
        elif other := [name for name, value in mine.items() if kept.get(name) != value]:
            raise CommandError(
                f"{self.path} holds a study of something else (other: {', '.join(other)}). Choose another --out, or "
                "delete it."
            )


class Trial(NamedTuple):
    """A trial that is still to be run, in any process."""

    number: int
    values: dict[str, Any]
    study: Study


def _train(trial: Trial) -> float | str:
    """The mean score of a trial's runs, or why there is none."""
    study = trial.study
    home, command = study.folder / f"trial-{trial.number}", f"cps-envs tune {study.recipe.name}"
    try:
        recipe = changed(study.recipe, trial.values)
        runs = [learn(TrainingJob(recipe, seed, home / f"seed-{seed}", command)) for seed in range(study.seeds)]
    except (CommandError, ValueError) as error:
        return str(error)
    return sum(float(run["best_score"]) for run in runs) / len(runs)


def suggest(trial: optuna.trial.Trial, knob: str, text: str, present: Any) -> Any:
    """The value that a sampler chooses within a range such as `1e-5:1e-3:log`, `2:10` or `a|b`."""
    parts = text.split(":")
    if "|" in text or len(parts) == 1:
        return typed(trial.suggest_categorical(knob, text.split("|")))
    low, high, log = _ends(knob, text)
    if isinstance(present, int):
        return trial.suggest_int(knob, int(low), int(high), log=log)
    return trial.suggest_float(knob, low, high, log=log)


def first_value(knob: str, text: str, present: Any) -> Any:
    """One value of a range.

    Raises:
        CommandError: it is no range.
    """
    if "|" in text or ":" not in text:
        return typed(text.split("|")[0])
    low, _, _ = _ends(knob, text)
    return int(low) if isinstance(present, int) else low


def _ends(knob: str, text: str) -> tuple[float, float, bool]:
    parts = text.split(":")
    try:
        low, high = float(parts[0]), float(parts[1])
    except ValueError:
        low, high = 1.0, 0.0
    log = parts[2:] == ["log"]
    if not low < high or (parts[2:] and not log) or (log and low <= 0):
        raise CommandError(f"{knob}={text}: write LOW:HIGH, LOW:HIGH:log with LOW above 0, or A|B|C")
    return low, high, log


def finished(study: optuna.Study) -> list[Tried]:
    """The trials that have ended well."""
    from optuna.trial import TrialState

    return [
        Tried(trial.number, float(trial.value or 0.0), dict(trial.user_attrs["values"]))
        for trial in study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
    ]
