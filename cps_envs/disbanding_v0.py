"""The disbanding problem through Gymnasium and PettingZoo, made from its declaration and its pages."""

from cps_envs.core.interfaces.forms import declare
from cps_envs.disbanding.pages import ATTACK, DEFENSE, RHYTHM, SWARM, THREATS
from cps_envs.disbanding.problem import DISBANDING

forms = declare(DISBANDING, __name__, attack=ATTACK, defense=DEFENSE, rhythm=RHYTHM, swarm=SWARM, threats=THREATS)
DisbandingAttackEnv, DisbandingAttackVectorEnv = forms.attack
DisbandingDefenseEnv, DisbandingDefenseVectorEnv = forms.defense
parallel_env, env, swarm_env = forms.parallel_env, forms.env, forms.swarm_env
