"""How often decoding returns the encoded joints, and what stands in the way where it does not.

    uv run python benchmarks/round_trip.py  # results/round_trip/report.json
    uv run python docs/render_readme.py  # the table of docs/arms.md

Configurations are uniform within the limits, seeds uniform within the seed error of each joint. A configuration is
back if no joint is off by more than 1e-3 rad; the causes of a miss are those of :mod:`er_il.spaces.round_trip`.
"""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import tyro
from arms import REDUNDANT
from rich.progress import Progress

from er_il.spaces.base import ArmSpace
from er_il.spaces.registry import make_arm_space
from er_il.spaces.round_trip import CAUSES, EXACT, SINGULAR, round_trips
from er_il.support.atomic_files import write_json
from er_il.support.provenance import provenance
from er_il.support.workers import cores, run_jobs

SPACES = ("erj", "erx", "era")
SEED_ERRORS = (0.1, 0.03)  # [rad]


def commanded(space: ArmSpace) -> list[str]:
    """What a space commands beside the pose: joints, coordinates, or the link that is the elbow."""
    frames = space.arm.angle_frames
    if space.kind == "era":
        return [frames.elbow] if frames else []
    return [name.removesuffix(".pos") for name in space.names[-space.arm.redundancy :]]


def measure(name: str, kind: str, seed_error: float, samples: int) -> dict[str, object]:
    """One row of the report."""
    arm = REDUNDANT[name]()
    space = make_arm_space(kind, arm)
    trips = round_trips(space, samples, seed_error=seed_error)
    missed = [trip for trip in trips if not trip.exact]
    causes = Counter(trip.cause for trip in missed)
    return {
        "arm": name,
        "joints": arm.dof,
        "commands": commanded(space),
        "space": kind,
        "seed_error": seed_error,
        "samples": samples,
        "exact": samples - len(missed),
        "causes": {cause: causes[cause] for cause in CAUSES},
        "ill_conditioned_samples": sum(trip.conditioning < SINGULAR for trip in trips),
        "best_conditioned_miss": max((trip.conditioning for trip in missed), default=None),
    }


def cells() -> Iterator[tuple[str, str, float]]:
    """What there is to measure: ERA describes one redundant joint only."""
    for name, build in REDUNDANT.items():
        for kind in SPACES if build().redundancy == 1 else SPACES[:2]:
            for seed_error in SEED_ERRORS:
                yield name, kind, seed_error


def main(samples: int = 3000, out: Path = Path("results/round_trip")) -> None:
    """Measure every arm; write the report."""
    with Progress() as progress:
        bar = progress.add_task("Round trips")
        jobs = [(measure, *cell, samples) for cell in cells()]
        rows = run_jobs(jobs, cores(), lambda done, total: progress.update(bar, completed=done, total=total))
    meta = {"exact": EXACT, "ill_conditioned": SINGULAR, "rng_seed": 0}
    write_json(out / "report.json", {"meta": provenance() | meta, "round_trips": rows})


if __name__ == "__main__":
    tyro.cli(main)
