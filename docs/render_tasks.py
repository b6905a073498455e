"""Render the pictures of docs/tasks.md: ``uv run python docs/render_tasks.py``.

A task's demonstration of seed 0: its start, three moments between, its end.
"""

from pathlib import Path
from typing import Any

import gymnasium
from PIL import Image

from er_il.envs.tasks import task_id, task_names
from er_il.report.films import Picture, moments

PICTURES = Path(__file__).parent / "images" / "tasks"
SEED = 0
MOMENTS = 5
WIDTH, GAP = 300, 4  # [px] of a moment, and between two


def render(task: str, path: Path) -> None:
    """Play a task's demonstration and write a row of pictures."""
    env = gymnasium.make(task_id(task), render_mode="rgb_array")
    env.reset(seed=SEED)
    world: Any = env.unwrapped
    actions = list(world.leader(SEED))
    shown = set(moments(range(len(actions) + 1), MOMENTS))
    pictures = []
    for step in range(len(actions) + 1):
        if step in shown:
            pictures.append(world.render())
        if step < len(actions):
            env.step(actions[step])
    env.close()
    path.parent.mkdir(parents=True, exist_ok=True)
    row(pictures).save(path, quality=85)


def row(pictures: list[Picture]) -> Image.Image:
    """Pictures side by side, made smaller."""
    height = round(WIDTH * pictures[0].shape[0] / pictures[0].shape[1])
    image = Image.new("RGB", (len(pictures) * (WIDTH + GAP) - GAP, height), "white")
    for place, picture in enumerate(pictures):
        small = Image.fromarray(picture).resize((WIDTH, height), Image.Resampling.LANCZOS)
        image.paste(small, (place * (WIDTH + GAP), 0))
    return image


if __name__ == "__main__":
    for name in task_names():
        render(name, PICTURES / f"{name}.webp")
        print(PICTURES / f"{name}.webp")
