"""How often decoding returns the encoded joints, and how long it takes: every preset, joint, ERJ and ERA.

    uv run python benchmarks/round_trip.py --samples 3000 --out benchmarks/round_trip.json

Configurations are uniform within the limits, seeds uniform within the seed error of each joint.
``exact``: the joints came back within 1e-3 rad. ``ambiguous``: not, but the solution found meets the
action and is nearer the seed, so that no decoder could have told from action and seed alone.
``unexplained``: status OK, away from limits and singularities, and yet wrong.
"""

import json
import platform
from importlib.metadata import version
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table

from er_il import Arm, make_action_space
from er_il.errors import ArmError
from er_il.round_trip import round_trips

ARMS = ("panda", "panda8", "xarm7")
SPACES = ("joint", "erj", "era")
SEED_ERRORS = (0.1, 0.05, 0.03)  # [rad]


def measure(arm: str, space: str, seed_error: float, samples: int) -> dict[str, object]:
    """One row of the table."""
    trips = round_trips(make_action_space(space, Arm.preset(arm)), samples, seed_error=seed_error)
    missed = [trip for trip in trips if not trip.exact]
    latency = np.percentile([1e3 * trip.latency for trip in trips], [50, 99])
    return {
        "arm": arm,
        "space": space,
        "seed_error_rad": seed_error,
        "samples": samples,
        "exact": 1 - len(missed) / samples,
        "ambiguous": sum(trip.ambiguous for trip in missed) / samples,
        "not_ok": sum(trip.decoded.status != "ok" for trip in missed) / samples,
        "unexplained": sum(not trip.explained for trip in missed) / samples,
        "worst_missed_conditioning": max((trip.conditioning for trip in missed), default=None),
        "p50_ms": latency[0],
        "p99_ms": latency[1],
        "iterations": float(np.mean([trip.decoded.iters for trip in trips])),
    }


def main(samples: int = 3000, out: Path | None = None) -> None:
    """Print the table, and write it with the versions that made it."""
    rows = []
    cells = [(arm, space, error) for arm in ARMS for space in SPACES for error in SEED_ERRORS]
    for arm, space, error in track(cells, description="Round trips"):
        try:
            rows.append(measure(arm, space, error, samples))
        except ArmError:  # ERA fixes one redundant joint only
            continue
    table = Table(*(key.replace("_", "\n") for key in rows[0]), box=None)
    for row in rows:
        table.add_row(*(f"{value:.4f}" if isinstance(value, float) else str(value) for value in row.values()))
    Console(width=140).print(table)
    if out is not None:
        packages = {name: version(name) for name in ("placo", "pin", "numpy")}
        meta = {"machine": platform.machine(), "python": platform.python_version(), **packages}
        out.write_text(json.dumps({"meta": meta, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    tyro.cli(main)
