"""Simulated environments that take encoded actions, for imitation and for reinforcement learning."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from er_il.envs.learning import LearningEnv, make_rl_env

__all__ = ["LearningEnv", "make_rl_env"]


def __getattr__(name: str) -> Any:
    # Imported on first use: the names of tasks are wanted without the kinematics.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from er_il.envs import learning

    return getattr(learning, name)
