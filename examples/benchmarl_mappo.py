"""MAPPO, IPPO and QMIX of BenchMARL on a defending team, in batches of episodes.

pip install cps-envs benchmarl "torchrl<0.12"
python examples/benchmarl_mappo.py --algorithm mappo --role FdiDefense --cpu-seconds 60
"""

import tempfile
import time
from contextlib import suppress

import torch
from benchmarl.algorithms import IppoConfig, MappoConfig, QmixConfig
from benchmarl.environments.pettingzoo.common import PettingZooClass
from benchmarl.experiment import Callback, Experiment, ExperimentConfig
from benchmarl.models.mlp import MlpConfig
from judge import run
from tensordict import TensorDict
from torchrl.envs import ExplorationType, set_exploration_type

from cps_agents.torchrl import TeamEnv

ALGORITHMS = {"mappo": MappoConfig, "ippo": IppoConfig, "qmix": QmixConfig}


TASK = {
    "__module__": __name__,  # BenchMARL pickles it
    "supports_discrete_actions": lambda self: True,
    **dict.fromkeys(("has_state", "has_render"), lambda *_: False),
    "max_steps": lambda self, env: 10_000,  # the game ends earlier
    "get_env_fun": lambda self, num_envs, **_: lambda: TeamEnv(self.name, num_envs, flat=True),
    "observation_spec": lambda self, env: env.full_observation_spec_unbatched.clone(),
    "action_spec": lambda self, env: env.full_action_spec_unbatched.clone(),
    **dict.fromkeys(("state_spec", "action_mask_spec", "info_spec"), lambda self, env: None),
}
Team = type("Team", (PettingZooClass,), TASK)  # the team that defends a problem, with its own batch of episodes


class Clock(Callback):
    """Ends an experiment as Ctrl-C does, which BenchMARL takes with grace."""

    def on_train_end(self, training_td, group):
        """Look at the clock."""
        if time.process_time() > self.end:
            raise KeyboardInterrupt


def train(role, cpu_seconds, algorithm):
    """Train, and return how the network acts."""
    config, clock = ExperimentConfig.get_from_yaml(), Clock()
    config.loggers, config.evaluation, config.create_json, config.save_folder = [], False, False, tempfile.mkdtemp()
    config.on_policy_collected_frames_per_batch, config.on_policy_minibatch_size = 2048, 512
    config.on_policy_n_minibatch_iters, config.on_policy_n_envs_per_worker, config.lr = 4, 64, 1e-3
    model = MlpConfig(num_cells=[64, 64], activation_class=torch.nn.Tanh, layer_class=torch.nn.Linear)
    parts = {"model_config": model, "critic_model_config": model, "config": config, "callbacks": [clock]}
    team, method = Team(role.removesuffix("Defense").lower(), {}), ALGORITHMS[algorithm].get_from_yaml()
    experiment = Experiment(team, method, seed=0, **parts)
    clock.end = time.process_time() + cpu_seconds
    if cpu_seconds:
        with suppress(KeyboardInterrupt):
            experiment.run()
    (group, agents), *_ = experiment.group_map.items()

    def act(rows):
        seen = torch.as_tensor(rows).reshape(-1, len(agents), rows.shape[1])
        found = TensorDict({group: TensorDict({"observation": seen}, seen.shape[:2])}, seen.shape[:1])
        with torch.no_grad(), set_exploration_type(ExplorationType.RANDOM):
            return experiment.policy(found)[group, "action"].numpy()

    return act


if __name__ == "__main__":
    run(train, __doc__, role="FdiDefense", algorithms=tuple(ALGORITHMS), per_agent=True, flat=True)
