"""BC and CQL of d3rlpy on what `cps-envs dataset` wrote: a Minari data set of a controller at play.

pip install "cps-envs[cli,data]"; pip install --no-deps d3rlpy   # d3rlpy asks for gymnasium 1.0.0, and needs it not
cps-envs dataset fdi --role attacker --episodes 500
python examples/d3rlpy_bc.py --algorithm bc --role FdiAttack --cpu-seconds 60
"""

import time

import d3rlpy
import minari
import numpy as np
from judge import run

CHUNK = 200  # gradient steps between two looks at the clock
CONFIGS = {"bc": d3rlpy.algos.DiscreteBCConfig, "cql": d3rlpy.algos.DiscreteCQLConfig}


def train(role, cpu_seconds, algorithm):
    """Train, and return how the network acts."""
    word = role.removesuffix("Attack").removesuffix("Defense").lower()
    (name,) = (each for each in minari.list_local_datasets() if f"/{word}/" in each)
    episodes = list(minari.load_dataset(name).iterate_episodes())
    columns = {
        "observations": np.concatenate([each.observations[:-1] for each in episodes]),
        "actions": np.concatenate([each.actions.reshape(len(each.actions), -1) for each in episodes]),
        "rewards": np.concatenate([each.rewards for each in episodes]),
        "terminals": np.concatenate([np.arange(len(each.rewards)) == len(each.rewards) - 1 for each in episodes]),
    }
    data = d3rlpy.dataset.MDPDataset(**columns, action_space=d3rlpy.ActionSpace.DISCRETE)
    learner = CONFIGS[algorithm](batch_size=256).create()
    learner.build_with_dataset(data)
    end = time.process_time() + cpu_seconds
    while time.process_time() < end:
        learner.fit(data, CHUNK, CHUNK, show_progress=False, logger_adapter=d3rlpy.logging.NoopAdapterFactory())
    return learner.predict


if __name__ == "__main__":
    run(train, __doc__, role="FdiAttack", algorithms=tuple(CONFIGS))
