"""What happens between the updates of a run: progress, evaluation on validation seeds, checkpoints."""

from __future__ import annotations

import time

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from agents.files import replacing
from agents.learning.export import network_of_model
from agents.learning.learner import Report
from agents.learning.presentation import make_card, policy_of
from agents.learning.run import Run
from agents.learning.seeds import VALIDATION
from agents.learning.training_envs import TrainingEnvs
from agents.zoo.files import save
from cps_envs.core.play import play_episodes
from cps_envs.core.types import other
from cps_envs.registration import find_problem

CHECKPOINT_EVERY_S = 60.0


class TrainingCallback(BaseCallback):
    """Evaluates at equal distances and at the end, keeps the best network, saves a checkpoint at each evaluation."""

    def __init__(self, run: Run, envs: TrainingEnvs, report: Report) -> None:
        super().__init__()
        self._run, self._envs, self._report = run, envs, report
        progress = run.read()
        best = progress.get("best_score")
        self._best = -np.inf if best is None else float(best)
        self._cpu_before_s = float(progress.get("cpu_s", 0.0))
        self._started_s = time.process_time()
        self._next_evaluation = 0
        self._saved_at = time.monotonic()
        self._note = ""

    @property
    def cpu_s(self) -> float:
        """CPU seconds of this run so far."""
        return self._cpu_before_s + time.process_time() - self._started_s

    def _on_training_start(self) -> None:
        recipe = self._run.recipe
        self._distance = max(recipe.total_steps // max(recipe.evaluations, 1), 1)
        self._next_evaluation = (self.num_timesteps // self._distance) * self._distance

    def _on_rollout_start(self) -> None:
        if self.num_timesteps >= self._next_evaluation:
            self._next_evaluation += self._distance
            self.evaluate()
            self.save()
        elif time.monotonic() - self._saved_at > CHECKPOINT_EVERY_S:
            self.save()
        self._report(self.num_timesteps, self._note)

    def _on_step(self) -> bool:
        return True

    def _on_training_end(self) -> None:
        self.evaluate()
        self.save()

    def save(self) -> None:
        """Write the checkpoint and how far the run is."""
        with replacing(self._run.checkpoint) as draft:
            self.model.save(draft)
        self._run.write(steps=self.num_timesteps, cpu_s=round(self.cpu_s, 1), best_score=self._finite_best())
        self._saved_at = time.monotonic()

    def evaluate(self) -> None:
        """Play validation episodes with the network as it is; if it is the best so far, keep it."""
        recipe = self._run.recipe
        network = network_of_model(self.model, recipe.activation)
        problem = find_problem(recipe.problem)
        card = make_card(self._run, self._envs, {})
        outcome = play_episodes(
            problem,
            problem.config(recipe.preset, recipe.overrides),
            {recipe.role: policy_of(card, network), other(recipe.role): card.opponent},
            VALIDATION[: recipe.evaluation_episodes],
        )
        score = recipe.score(outcome)
        row = {"steps": self.num_timesteps, "cpu_s": round(self.cpu_s, 1), "validation": score}
        self._run.append_evaluation({**row, **{name: float(values.mean()) for name, values in outcome.items()}})
        self.logger.record("validation/score", score)
        if score > self._best or not self._run.card.is_file():
            self._best = score
            save(self._run.card, make_card(self._run, self._envs, row), {self._run.seed: network})
        self._note = f"validation {score:.3g}, best {self._best:.3g}"

    def save_unfinished(self) -> None:
        """Leave something usable when the run is interrupted."""
        if not self._run.card.is_file():
            self.evaluate()
        self.save()

    def _finite_best(self) -> float | None:
        return self._best if np.isfinite(self._best) else None
