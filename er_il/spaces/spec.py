"""Location of an action space's specification among the features of a LeRobot dataset."""

from collections.abc import Mapping
from typing import Any

from er_il.support.errors import DatasetError

SPEC_VERSION = 1
ACTION = "action"
SPEC = "er_il"  # features["action"]["info"][SPEC] is Layout.spec(), for er_il's own ActionSpace.spec()


def action_spec(columns: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the specification of the actions of a dataset, given its features.

    Raises:
        DatasetError: the action column carries none.
    """
    try:
        return columns[ACTION]["info"][SPEC]
    except (KeyError, TypeError) as error:
        raise DatasetError("The dataset does not say what its actions mean (no er_il specification).") from error
