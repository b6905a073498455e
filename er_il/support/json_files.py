"""JSON files, which may come from others: what is no JSON object is told by its path."""

import json
from pathlib import Path
from typing import Any

from er_il.support.errors import ErIlError


def read_json(path: Path, error: type[ErIlError]) -> dict[str, Any]:
    """Read a JSON object.

    Args:
        path: The file.
        error: What to raise if it is missing, or holds anything else.
    """
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError) as cause:
        raise error(f"There is no file {path}.") from cause
    except IsADirectoryError as cause:
        raise error(f"{path} is a folder, not a file.") from cause
    except (ValueError, RecursionError) as cause:  # no JSON, no UTF-8, numbers of thousands of digits; or nested deeply
        raise error(f"{path} is damaged, not valid JSON.") from cause
    if not isinstance(values, dict):
        raise error(f"{path} is damaged: it holds no JSON object but {type(values).__name__}.")
    return values
