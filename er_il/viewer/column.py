"""Single columns of a LeRobot dataset's tables, for one episode."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pyarrow.dataset as pads

from er_il.datasets.rewriting import EPISODE

DATA, EPISODES = "data", "meta/episodes"


def read_rows(dataset: Path, table: str, columns: Sequence[str], number: int) -> list[dict[str, Any]]:
    """Read columns of a table, :data:`DATA` or :data:`EPISODES`, in the rows of an episode."""
    rows = pads.dataset(dataset / table, format="parquet")
    return rows.to_table(columns=list(columns), filter=pads.field(EPISODE) == number).to_pylist()
