"""Serial chains as URDF files, for tests that need more arms than there are presets."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from er_il import Arm


def write_chain(
    path: Path,
    joints: int,
    seed: int = 0,
    *,
    kind: str = "revolute",
    limits: tuple[float, float] = (-2.8, 2.8),
    velocity: float | None = 2.0,
    order: Sequence[int] | None = None,
) -> Path:
    """Write a random arm: alternately twisting and bending joints, 0.2 to 0.4 m apart.

    ``order`` is the order in which the joints stand in the file; the kinematics do not depend on it.
    """
    rng = np.random.default_rng(seed)
    lower, upper = limits
    speed = f' velocity="{velocity}"' if velocity is not None else ""
    parts = []
    for i in range(joints):
        bend = f"{(np.pi / 2) * (1 if i % 2 else -1) if i else 0.0:.9f} 0 {rng.uniform(-0.2, 0.2):.6f}"
        x, y = rng.uniform(-0.05, 0.05, 2)
        z = rng.uniform(0.2, 0.4) if i % 2 == 0 else 0.0
        parts.append(
            f'<joint name="j{i + 1}" type="{kind}"><parent link="l{i}"/><child link="l{i + 1}"/>'
            f'<origin xyz="{x:.6f} {y:.6f} {z:.6f}" rpy="{bend}"/><axis xyz="0 0 1"/>'
            f'<limit lower="{lower}" upper="{upper}" effort="10"{speed}/></joint>'
        )
    parts = [parts[i] for i in order] if order is not None else parts
    links = "".join(f'<link name="l{i}"/>' for i in range(joints + 1))
    tool = (
        '<link name="tool"/><joint name="tool_joint" type="fixed">'
        f'<parent link="l{joints}"/><child link="tool"/><origin xyz="0.05 0 0.15"/></joint>'
    )
    path.write_text(f'<robot name="chain{joints}">{links}{"".join(parts)}{tool}</robot>')
    return path


def chain_arm(folder: Path, joints: int, seed: int = 0) -> Arm:
    """A random arm of that many joints."""
    return Arm.from_urdf(write_chain(folder / f"chain{joints}_{seed}.urdf", joints, seed), ee_frame="tool")
