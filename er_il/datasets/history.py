"""What the re-encodings of a dataset have written down, in ``meta/er_il.json``."""

import json
from pathlib import Path
from typing import Any

from er_il.support.errors import DatasetError

HISTORY = Path("meta/er_il.json")
SPECIFICATION = "spec"  # in an entry: what the actions mean, where their feature must not say it


def read_history(root: Path) -> list[Any]:
    """Read the entries, the last one written last; none if there is no such file.

    Raises:
        DatasetError: the file is damaged.
    """
    path = root / HISTORY
    try:
        history = json.loads(path.read_text()) if path.exists() else []
    except (ValueError, RecursionError) as error:
        raise DatasetError(f"{path} is damaged, not valid JSON.") from error
    if not isinstance(history, list):
        raise DatasetError(f"{path} is damaged: it holds no list.")
    return history


def recorded_spec(root: Path) -> Any:
    """The specification of the actions in the last entry; None if it has none.

    Joints that were decoded to the names, order and units which they had before have the very feature of the dataset
    that was encoded, else LeRobot would not merge them with it; what they mean stands here instead.
    """
    history = read_history(root)
    return history[-1].get(SPECIFICATION) if history and isinstance(history[-1], dict) else None


def append_to_history(root: Path, entry: dict[str, Any]) -> None:
    """Add an entry. Specifications of earlier ones are left out: they are of other actions."""
    earlier = [
        {key: value for key, value in each.items() if key != SPECIFICATION} if isinstance(each, dict) else each
        for each in read_history(root)
    ]
    (root / HISTORY).write_text(json.dumps([*earlier, entry], indent=2))
