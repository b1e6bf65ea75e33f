"""The rogue-vehicle problem through Gymnasium and PettingZoo, made from its declaration and its pages."""

from cps_envs.core.interfaces.forms import declare
from cps_envs.rogue.pages import ATTACK, DEFENSE, RHYTHM, SWARM, THREATS
from cps_envs.rogue.problem import ROGUE

forms = declare(ROGUE, __name__, attack=ATTACK, defense=DEFENSE, rhythm=RHYTHM, swarm=SWARM, threats=THREATS)
RogueAttackEnv, RogueAttackVectorEnv = forms.attack
RogueDefenseEnv, RogueDefenseVectorEnv = forms.defense
parallel_env, env, swarm_env = forms.parallel_env, forms.env, forms.swarm_env
