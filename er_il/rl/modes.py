"""The action modes of agents: those of the environments, and JAiLeR, which acts through a controller that it learns."""

from er_il.envs.learning import MODES
from er_il.spaces.joint import JOINT
from er_il.spaces.registry import AT
from er_il.support.errors import UnknownNameError

AGENT = "er_il_agent"  # type of the policies that agents are to LeRobot
JAILER, JAILER_REWARDED = "jailer", "jailer-rew"
AGENT_MODES = (*MODES, JAILER, JAILER_REWARDED)


def has_controller(mode: str) -> bool:
    """True for JAiLeR, with the task's reward or without.

    Raises:
        UnknownNameError: no such mode.
    """
    if mode in (JAILER, JAILER_REWARDED):
        return True
    if mode.partition(AT)[0] not in MODES:
        raise UnknownNameError("mode", mode, AGENT_MODES)
    return False


def mode_of_environment(mode: str) -> str:
    """The mode of the environment that an agent of a mode acts in: JAiLeR's controller commands the joints.

    Raises:
        UnknownNameError: no such mode.
    """
    return JOINT if has_controller(mode) else mode
