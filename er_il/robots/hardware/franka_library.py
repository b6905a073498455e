"""The library ``franka-rs``: its import, and its errors in words."""

from collections.abc import Callable
from typing import Any

from er_il.support.errors import ReflexError, RobotError

# Part of a failure's name -> what to do about it.
REMEDIES = {
    "communication_constraints": "Packets were lost or late: connect this computer straight to the control box by "
    "cable, use a real-time kernel, and end what else keeps the computer busy.",
    "reflex": "It has touched something: see that its way is free.",
    "collision": "It has come close to itself, or touched something: see that its way is free.",
    "limits": "It was about to exceed one of its limits: lower the speed.",
}
AGAIN = "The arm holds. Starting again recovers it."


def library() -> Any:
    """The module ``franka``.

    Raises:
        RobotError: it is not installed.
    """
    try:
        import franka
    except ImportError as error:
        raise RobotError(
            "Franka arms need the package franka-rs: install er_il with its extra `franka`, as in "
            "pip install 'lerobot_env_er_il[franka]'."
        ) from error
    return franka


def in_words(address: str, ask: Callable[[], Any]) -> Any:
    """The answer of the library about an arm at an address.

    Raises:
        ReflexError: the arm has stopped its motion by itself.
        RobotError: anything else went wrong.
    """
    try:
        return ask()
    except library().ControlException as error:
        reasons = ", ".join(error.errors) or str(error)
        remedies = [remedy for part, remedy in REMEDIES.items() if part in reasons]
        raise ReflexError(" ".join([f"The arm at {address} has stopped ({reasons}).", *remedies[:1], AGAIN])) from error
    except library().FrankaError as error:
        if error.kind == "network":
            said = f"There is no connection to {address} ({error}). A moving arm stops by itself. Check its power, its "
            said += "cable and that FCI is active in Desk."
        elif error.kind == "realtime":
            said = f"{str(error).rstrip('.')}. Use one that has; for a simulated arm, set FRANKA_REALTIME=ignore."
        else:
            said = f"The arm at {address} refuses ({error.kind}): {error}"
        raise RobotError(said) from error
