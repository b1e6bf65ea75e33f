"""The HVAC problem through Gymnasium and PettingZoo, made from its declaration and its pages."""

from cps_envs.core.interfaces.forms import declare
from cps_envs.hvac.pages import ATTACK, DEFENSE, RHYTHM, SWARM, THREATS
from cps_envs.hvac.problem import HVAC

forms = declare(HVAC, __name__, attack=ATTACK, defense=DEFENSE, rhythm=RHYTHM, swarm=SWARM, threats=THREATS)
HvacAttackEnv, HvacAttackVectorEnv = forms.attack
HvacDefenseEnv, HvacDefenseVectorEnv = forms.defense
parallel_env, env, swarm_env = forms.parallel_env, forms.env, forms.swarm_env
