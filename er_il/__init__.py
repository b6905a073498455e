"""Redundancy-aware action spaces for robot learning."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from er_il.arms.arm import Arm, ArmAngleFrames
    from er_il.kinematics.solver import Status
    from er_il.spaces.action_space import ActionSpace, Decoded, from_spec, make_action_space
    from er_il.support.errors import ErIlError

__all__ = ["ActionSpace", "Arm", "ArmAngleFrames", "Decoded", "ErIlError", "Status", "from_spec", "make_action_space"]

# Public name -> its module, imported on first use: `import er_il` loads neither NumPy nor Pinocchio nor Placo.
_MODULES = {
    "Arm": "er_il.arms.arm",
    "ArmAngleFrames": "er_il.arms.arm",
    "Status": "er_il.kinematics.solver",
    "ActionSpace": "er_il.spaces.action_space",
    "Decoded": "er_il.spaces.action_space",
    "from_spec": "er_il.spaces.action_space",
    "make_action_space": "er_il.spaces.action_space",
    "ErIlError": "er_il.support.errors",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
