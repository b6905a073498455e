"""The operator of LeRobot's stock commands, counting steps: by the clock, a busy machine would make fewer of them."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from itertools import count
from typing import Any

import pytest
from lerobot.datasets import LeRobotDataset
from lerobot.rollout.strategies import episodic
from lerobot.scripts import lerobot_record
from lerobot.utils.keyboard_input import apply_recording_control

EPISODE_TIME = 300  # [s] for --dataset.episode_time_s: the operator ends the episode before


@contextmanager
def right_arrow_after(steps: int) -> Generator[None]:
    """End each episode that is recorded after so many steps, as with the right arrow key."""
    events = {"exit_early": False, "rerecord_episode": False, "stop_recording": False}
    recorded = count(1)
    add_frame = LeRobotDataset.add_frame

    def add(dataset: LeRobotDataset, frame: dict[str, Any]) -> None:
        add_frame(dataset, frame)
        if next(recorded) % steps == 0:
            apply_recording_control("right", events)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(LeRobotDataset, "add_frame", add)
        for module in (lerobot_record, episodic):
            patch.setattr(module, "init_keyboard_listener", lambda: (None, events))
        yield


def interrupted_after(calls: int, function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that can be called so many times before the operator presses Ctrl-C."""
    called = count()

    def call(*args: Any, **kwargs: Any) -> Any:
        if next(called) == calls:
            raise KeyboardInterrupt
        return function(*args, **kwargs)

    return call
