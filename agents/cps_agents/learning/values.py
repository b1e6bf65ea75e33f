"""Learning the value function alone at first, lest it spoil an imitated policy while it knows nothing."""

from __future__ import annotations

from stable_baselines3.common.callbacks import BaseCallback

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
