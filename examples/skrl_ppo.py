"""PPO of skrl.

pip install cps-envs skrl torch
python examples/skrl_ppo.py --role FdiAttack --cpu-seconds 60
"""

import time

import gymnasium
import torch
from judge import run
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.trainers.torch import SequentialTrainer
from skrl.utils.model_instantiators.torch import categorical_model, deterministic_model

STEPS = 32  # of each episode between two updates


def train(role, cpu_seconds):
    """Train, and return how the network acts."""
    torch.set_num_threads(1)
    env = wrap_env(gymnasium.make_vec(f"cps_envs/{role}-v0", 64, autoreset="same_step"), wrapper="gymnasium")
    spaces = {"observation_space": env.observation_space, "action_space": env.action_space, "device": "cpu"}
    network = [{"name": "net", "input": "OBSERVATIONS", "layers": [64, 64], "activations": "tanh"}]
    models = {
        "policy": categorical_model(**spaces, network=network, output="ACTIONS"),
        "value": deterministic_model(**spaces, network=network, output="ONE"),
    }
    config = PPO_CFG(rollouts=STEPS, learning_epochs=4, mini_batches=4, learning_rate=1e-3)
    config.experiment.write_interval = config.experiment.checkpoint_interval = 0
    agent = PPO(
        models=models, memory=RandomMemory(memory_size=STEPS, num_envs=env.num_envs, device="cpu"), cfg=config, **spaces
    )
    trainer = SequentialTrainer(
        env=env, agents=agent, cfg={"timesteps": 10 * STEPS, "headless": True, "disable_progressbar": True}
    )
    agent.init()
    end = time.process_time() + cpu_seconds
    while time.process_time() < end:
        trainer.train()
    return lambda rows: models["policy"].act({"observations": torch.as_tensor(rows)}, role="policy")[0].numpy()


if __name__ == "__main__":
    run(train, __doc__, role="FdiAttack")
