"""Writing demos as a LeRobot dataset."""

import os
import shutil
from pathlib import Path
from typing import Any

import av.logging
import gymnasium
import numpy as np
from lerobot.datasets import LeRobotDataset
from lerobot.datasets.io_utils import write_info
from lerobot.utils.utils import SuppressProgressBars

from er_il.datasets.demos import Demo
from er_il.datasets.normalisation import normalise_actions, normalise_observations
from er_il.datasets.recipe import Recipe
from er_il.datasets.record import DatasetRecord
from er_il.datasets.schema import DEMO_SEED, ENVIRONMENT_STATE, IMAGES, LEADER_JOINTS, STATE, features
from er_il.envs.protocol import robot_env
from er_il.spaces.layout import Layout
from er_il.spaces.spec import ACTION

# LeRobot's encoder drops frames when its queue is full, as a live camera's must be; ours can wait.
_QUEUE_SIZE = 1_000_000


class Writer:
    """Writes demos as a LeRobot dataset."""

    def __init__(self, recipe: Recipe, world: gymnasium.Env[Any, Any], layout: Layout, root: Path) -> None:
        # Without LeRobot's footers, which it writes at the end, an interrupted dataset is unreadable.
        shutil.rmtree(root, ignore_errors=True)
        self._recipe, self._layout = recipe, layout
        os.environ.setdefault("SVT_LOG", "1")  # errors only: the encoders would bury the progress bar
        av.logging.set_libav_level(av.logging.ERROR)
        inner = robot_env(world)
        self._description: str = inner.task_description
        self._dataset = LeRobotDataset.create(
            repo_id=f"er_il/{recipe.task}",
            root=root,
            fps=world.metadata["render_fps"],
            features=features(
                layout,
                inner.state_names,
                inner.environment_state_names,
                recipe.cameras,
                recipe.image_size,
            ),
            robot_type=recipe.arm,
            video_backend="pyav",
            streaming_encoding=True,
            encoder_queue_maxsize=_QUEUE_SIZE,
        )

    def add(self, demo: Demo) -> None:
        actions = self._layout.encode(demo.joints).astype(np.float32)
        for step in range(len(demo)):
            frame = {
                ACTION: actions[step],
                STATE: demo.state[step],
                ENVIRONMENT_STATE: demo.environment_state[step],
                LEADER_JOINTS: demo.joints[step],
                DEMO_SEED: np.array([demo.seed]),
                "task": self._description,
            }
            self._dataset.add_frame(frame | {IMAGES + name: images[step] for name, images in demo.images.items()})
        with SuppressProgressBars():
            self._dataset.save_episode()

    def finish(self, dropped: dict[int, str]) -> None:
        self._dataset.finalize()
        info = self._dataset.meta.info
        info.splits = self._recipe.splits
        write_info(info, self._dataset.root)
        normalise_observations(self._dataset.root)
        normalise_actions(self._dataset.root)
        DatasetRecord(self._recipe, dropped).write(self._dataset.root)
