"""False data injection through Gymnasium and PettingZoo, made from its declaration and its pages."""

from cps_envs.core.interfaces.forms import declare
from cps_envs.fdi.pages import ATTACK, DEFENSE, RHYTHM, SWARM, THREATS
from cps_envs.fdi.problem import FDI

forms = declare(FDI, __name__, attack=ATTACK, defense=DEFENSE, rhythm=RHYTHM, swarm=SWARM, threats=THREATS)
FdiAttackEnv, FdiAttackVectorEnv = forms.attack
FdiDefenseEnv, FdiDefenseVectorEnv = forms.defense
parallel_env, env, swarm_env = forms.parallel_env, forms.env, forms.swarm_env
