"""Attackers and defenders of cyber-physical systems as Gymnasium and PettingZoo environments.

Importing this package registers its environments, so `gymnasium.make("cps_envs:cps_envs/DisbandingAttack-v0")` works
anywhere. `__all__` is the public interface; what is behind it loads when it is first asked for.
"""

from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from cps_envs.core.policies.trust import trust
from cps_envs.registration import PROBLEMS, find_problem, learning_env, load_config, register_all

if TYPE_CHECKING:
    from cps_envs.core import conformance as conformance
    from cps_envs.core import types as types
    from cps_envs.core.compute.kernels import borrowed as borrowed
    from cps_envs.core.compute.kernels import clip as clip
    from cps_envs.core.compute.kernels import inlined as inlined
    from cps_envs.core.compute.kernels import kernel as kernel
    from cps_envs.core.compute.kernels import pack as pack
    from cps_envs.core.compute.kernels import records as records
    from cps_envs.core.compute.kernels import unpack as unpack
    from cps_envs.core.compute.kernels import view as view
    from cps_envs.core.declare import config as config
    from cps_envs.core.declare.cycles import read_drive_cycle as read_drive_cycle
    from cps_envs.core.declare.cycles import read_fcd as read_fcd
    from cps_envs.core.declare.fields import Field as Field
    from cps_envs.core.declare.fields import Fields as Fields
    from cps_envs.core.declare.fields import encode_row as encode_row
    from cps_envs.core.declare.foreign import ForeignSettingWarning as ForeignSettingWarning
    from cps_envs.core.declare.series import Series as Series
    from cps_envs.core.declare.training import Training as Training
    from cps_envs.core.errors import ConfigurationError as ConfigurationError
    from cps_envs.core.game.game import Game as Game
    from cps_envs.core.game.play import play_episodes as play_episodes
    from cps_envs.core.game.problem import Problem as Problem
    from cps_envs.core.game.recording import Recording as Recording
    from cps_envs.core.game.recording import record_episode as record_episode
    from cps_envs.core.interfaces.forms import declare as declare
    from cps_envs.core.interfaces.learning_env import LearningVectorEnv as LearningVectorEnv
    from cps_envs.core.interfaces.registration import register as register
    from cps_envs.core.learning.wiring import WiredBox as WiredBox
    from cps_envs.core.picture.viewer import CanvasViewer as CanvasViewer
    from cps_envs.core.policies.policy import AnalyticPolicy as AnalyticPolicy
    from cps_envs.core.policies.policy import RoleSpec as RoleSpec
    from cps_envs.core.policies.seen import Seen as Seen
    from cps_envs.hvac.houses import house as house
    from cps_envs.hvac.weather_files import read_epw as read_epw
    from cps_envs.hvac.weather_files import read_tmy3 as read_tmy3

CORE = "cps_envs.core"
KERNELS = ("borrowed", "clip", "inlined", "kernel", "pack", "records", "unpack", "view")
HOMES = {  # name -> module, or module:attribute
    "house": "cps_envs.hvac.houses:house",
    "read_epw": "cps_envs.hvac.weather_files:read_epw",
    "read_tmy3": "cps_envs.hvac.weather_files:read_tmy3",
    "conformance": f"{CORE}.conformance",  # public checks of a problem of your own
    "types": f"{CORE}.types",
    **{name: f"{CORE}.compute.kernels:{name}" for name in KERNELS},
    "config": f"{CORE}.declare.config",
    "Field": f"{CORE}.declare.fields:Field",
    "Fields": f"{CORE}.declare.fields:Fields",
    "encode_row": f"{CORE}.declare.fields:encode_row",
    "read_drive_cycle": f"{CORE}.declare.cycles:read_drive_cycle",  # to a series in m/s
    "read_fcd": f"{CORE}.declare.cycles:read_fcd",  # of SUMO, likewise
    "ForeignSettingWarning": f"{CORE}.declare.foreign:ForeignSettingWarning",
    "Series": f"{CORE}.declare.series:Series",  # a quantity over time, in fields that take one
    "Training": f"{CORE}.declare.training:Training",
    "ConfigurationError": f"{CORE}.errors:ConfigurationError",
    "Game": f"{CORE}.game.game:Game",
    "play_episodes": f"{CORE}.game.play:play_episodes",
    "record_episode": f"{CORE}.game.recording:record_episode",
    "Recording": f"{CORE}.game.recording:Recording",  # what it returns
    "Problem": f"{CORE}.game.problem:Problem",
    "declare": f"{CORE}.interfaces.forms:declare",
    "register": f"{CORE}.interfaces.registration:register",
    "LearningVectorEnv": f"{CORE}.interfaces.learning_env:LearningVectorEnv",  # what `learning_env` returns
    "WiredBox": f"{CORE}.learning.wiring:WiredBox",  # its observation space
    "CanvasViewer": f"{CORE}.picture.viewer:CanvasViewer",
    "AnalyticPolicy": f"{CORE}.policies.policy:AnalyticPolicy",
    "RoleSpec": f"{CORE}.policies.policy:RoleSpec",
    "Seen": f"{CORE}.policies.seen:Seen",
}

try:
    __version__ = version("cps-envs")
except PackageNotFoundError:  # running from a source tree that is not installed
    __version__ = "0+unknown"

register_all()

__all__ = ["PROBLEMS", "__version__", "find_problem", "learning_env", "load_config", "trust", *HOMES]


def __getattr__(name: str) -> Any:
    if name not in HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = HOMES[name].partition(":")
    found = import_module(module)
    globals()[name] = getattr(found, attribute) if attribute else found
    return globals()[name]
