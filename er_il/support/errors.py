"""Errors that a user can cause, each with a message that names the valid choices.

Everything here derives from :class:`ErIlError`, which the command line prints as one line with
exit code 2. Anything else is a bug and keeps its traceback.
"""

from collections.abc import Iterable


class ErIlError(Exception):
    """Base of every error that a user's input can cause."""


class UnknownNameError(ErIlError):
    """A name that is not among the valid ones."""

    def __init__(self, kind: str, name: object, choices: Iterable[str]) -> None:
        super().__init__(f"Unknown {kind} {str(name)!r}. Valid: {', '.join(choices) or 'none'}.")


class ArmError(ErIlError):
    """A URDF that does not describe the arm that was asked for."""


class ShapeError(ErIlError, ValueError):
    """An array of the wrong shape; says the shape it got against the one it needs."""

    def __init__(self, what: str, got: tuple[int, ...], expected: str) -> None:
        super().__init__(f"{what} has shape {got}, expected {expected}.")


class NumbersError(ErIlError, ValueError):
    """Values that are no numbers, not finite, or beyond what they can mean; says which, and what is expected."""


class NotResetError(ErIlError, ValueError):
    """An environment that was told to step before its first reset."""

    def __init__(self) -> None:
        super().__init__("There is no episode to step in: call reset first.")


class BoundsError(ErIlError, ValueError):
    """A change larger than the bounds that a delta space declares."""


class SpecError(ErIlError):
    """An action specification that is unreadable or does not match."""


class RandomisationError(ErIlError, ValueError):
    """A range of a task's randomisation that is none."""


class DatasetError(ErIlError):
    """A dataset that is missing, unreadable or not what the command needs."""


class PolicyError(ErIlError):
    """A policy that is missing or was trained for another action space, arm or frame."""


class PlanError(ErIlError):
    """No collision-free motion exists for the scripted leader; the demo is dropped and counted."""


class RenderError(ErIlError):
    """The machine cannot render off screen."""


class RobotError(ErIlError):
    """A robot that cannot be reached, is not ready, or has stopped."""


class ReflexError(RobotError):
    """A robot that has stopped by itself to protect its surroundings, and can be recovered."""
