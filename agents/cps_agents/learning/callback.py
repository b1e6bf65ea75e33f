"""What happens between the updates of a run: progress, evaluation on validation seeds, checkpoints, trackers.

At first the value function may learn alone, lest it spoil an imitated policy while it knows nothing.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import KVWriter

from cps_agents.files import replacing
from cps_agents.learning.demonstrations import validate
from cps_agents.learning.export import make_card, network_of_model, policy_of
from cps_agents.learning.run import Report, Run
from cps_agents.learning.tracking import RunTracker
from cps_agents.learning.training_envs import TrainingEnvs
from cps_agents.zoo.files import save


class TrackerWriter(KVWriter):
    """Hands on the numbers; text, figures and films stay behind."""

    def __init__(self, tracker: RunTracker) -> None:
        self._tracker = tracker

    def write(self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0) -> None:
        """What one `dump` of the logger holds."""
        numbers = {
            name: float(value) for name, value in key_values.items() if isinstance(value, (int, float, np.number))
        }
        self._tracker.log(numbers, step)

    def close(self) -> None:
        """The tracker is closed where it was made."""


VALUE_PARTS = ("mlp_extractor.value_net", "value_net", "lstm_critic")


class ValueWarmUp(BaseCallback):
    """Freezes everything but the value function for the first updates of a run."""

    def __init__(self, updates: int) -> None:
        super().__init__()
        self._left = updates

    def _on_training_start(self) -> None:
        self._left = self._left if self.num_timesteps == 0 else 0
        self._let_learn(self._left == 0)

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        if self._left == 0:
            self._let_learn(True)
        self._left -= 1

    def _let_learn(self, free: bool) -> None:
        for name, weight in self.model.policy.named_parameters():
            if not name.startswith(VALUE_PARTS):
                weight.requires_grad_(free)


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
        self.note = ""

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
        self._report(self.num_timesteps, self.note)

    def _on_step(self) -> bool:
        return not self.spent

    @property
    def spent(self) -> bool:
        """Whether the run has used up its CPU time."""
        return 0 < self._run.recipe.most_cpu_s <= self.cpu_s

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
        outcome = validate(recipe, policy_of(make_card(self._run, self._envs, {}), network))
        score = recipe.score(outcome)
        row = {"steps": self.num_timesteps, "cpu_s": round(self.cpu_s, 1), "validation": score}
        self._run.append_evaluation({**row, **{name: float(values.mean()) for name, values in outcome.items()}})
        self.logger.record("validation/score", score)
        if score > self._best or not self._run.card.is_file():
            self._best = score
            save(self._run.card, make_card(self._run, self._envs, row), {self._run.seed: network})
        self.note = f"validation {score:.3g}, best {self._best:.3g}"

    def save_unfinished(self, *, checkpoint: bool = True) -> None:
        """Leave something usable when the run is interrupted; without a new checkpoint it goes on from the last one."""
        if not self._run.card.is_file():
            self.evaluate()
        if checkpoint:
            self.save()
        self._run.write(cpu_s=round(self.cpu_s, 1))

    def _finite_best(self) -> float | None:
        return self._best if np.isfinite(self._best) else None
