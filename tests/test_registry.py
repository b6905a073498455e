"""The registry: what importing sim_tasks loads, step limits, and tasks without a leader."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import sim_tasks
from er_il.support.errors import ErIlError, UnknownNameError
from sim_tasks import TaskEntry, register, registry
from sim_tasks.tasks.arm_task import ArmTask
from sim_tasks.tasks.lift_cup import LiftCup
from sim_tasks.tasks.registration import NoLeaderError, leader_class


class BareLift(LiftCup):
    """Lift Cup without a leader, and with a shorter limit."""

    task = "bare_lift"


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch) -> TaskEntry:
    monkeypatch.setattr(registry, "_entries", dict(registry._entries))
    entry = TaskEntry(BareLift.task, f"{__name__}:BareLift", max_steps=12)
    monkeypatch.setattr("gymnasium.envs.registration.registry", dict(gymnasium.registry))
    register(entry)
    return entry


def test_importing_registers_the_tasks_and_loads_no_simulator() -> None:
    code = """
import sys, sim_tasks, gymnasium
assert {entry.id for entry in sim_tasks.TASKS} <= set(gymnasium.registry)
heavy = {"mujoco", "pinocchio", "placo", "torch", "lerobot", "er_il.arms.arm"} & set(sys.modules)
sys.exit(f"loaded {heavy}" if heavy else 0)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("module", ["sim_tasks.tasks.lift_cup", "sim_tasks.leader.motion", "sim_tasks.world.scene"])
def test_a_gl_backend_that_fails_is_one_clear_error(module: str) -> None:
    code = f"""
import os
os.environ["MUJOCO_GL"] = "nonsense"
from er_il.support.errors import RenderError
try:
    import {module}
except RenderError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.stdout.startswith("MuJoCo does not start with MUJOCO_GL='nonsense'"), done.stderr
    assert "Valid: egl, osmesa, glfw" in done.stdout


@pytest.mark.parametrize("entry", sim_tasks.TASKS)
def test_every_entry_names_its_class_limit_and_leader(entry: TaskEntry) -> None:
    env = gymnasium.make(entry.id)
    world = env.unwrapped
    assert isinstance(world, ArmTask)
    assert (world.task, world.max_steps) == (entry.task, entry.max_steps)
    assert env.spec is not None and env.spec.max_episode_steps == entry.max_steps
    assert callable(leader_class(entry.task))


def test_a_task_without_a_leader_is_a_task(bare: TaskEntry) -> None:
    env = gymnasium.make(bare.id)
    check_env(env.unwrapped, skip_render_check=True)
    observation, _ = env.reset(seed=0)
    rewards = []
    for step in range(1, bare.max_steps + 1):
        observation, reward, terminated, truncated, info = env.step(observation["agent_pos"][:8])
        rewards.append(reward)
        assert not terminated and truncated == (step == bare.max_steps)
    assert info["failure"] == "timeout" and not info["is_success"]
    assert np.ptp(rewards) < 0.01


def test_asking_a_task_without_a_leader_for_a_demonstration_names_those_with_one(bare: TaskEntry) -> None:
    world = gymnasium.make(bare.id).unwrapped
    assert isinstance(world, ArmTask) and issubclass(NoLeaderError, ErIlError)
    world.reset(seed=0)
    message = (
        "^The task bare_lift has no leader to demonstrate it. Tasks with a leader: bimanual_press, .*out_of_stand.$"
    )
    with pytest.raises(NoLeaderError, match=message):
        world.leader(0)
    with pytest.raises(NoLeaderError, match="bare_lift has no leader"):
        gymnasium.make(bare.id, via_range=0.02)


def test_a_class_that_is_not_registered_names_the_registered_tasks() -> None:
    with pytest.raises(UnknownNameError, match=r"^Unknown task 'bare_lift'. Valid: bimanual_press, .*retrieve_bear"):
        BareLift()


@pytest.mark.parametrize(
    ("limit", "outcome"), [(None, (False, True, "timeout")), (-1, (False, True, "timeout")), (5, (False, True, ""))]
)
def test_the_step_limit_truncates_with_and_without_gymnasiums(
    bare: TaskEntry, limit: int | None, outcome: tuple[bool, bool, str]
) -> None:
    env = gymnasium.make(bare.id, max_episode_steps=limit)
    observation, _ = env.reset(seed=0)
    ended, steps = False, 0
    while not ended:
        observation, _, terminated, truncated, info = env.step(observation["agent_pos"][:8])
        steps += 1
        ended = terminated or truncated
    assert (terminated, truncated, info["failure"]) == outcome
    assert steps == (5 if limit == 5 else bare.max_steps)


def test_success_at_the_step_limit_is_success(monkeypatch: pytest.MonkeyPatch) -> None:
    env = gymnasium.make("sim_tasks/LiftCup-v0")
    world = env.unwrapped
    assert isinstance(world, ArmTask)
    env.reset(seed=0)
    actions = [action.astype(np.float32) for action in world.leader(0)]
    steps = next(step for step, action in enumerate(actions, 1) if env.step(action)[2])
    monkeypatch.setattr(world, "max_steps", steps)
    world.reset(seed=0)
    for action in actions[:steps]:
        _, reward, terminated, truncated, info = world.step(action)
    assert (reward, terminated, truncated) == (1.0, True, False)
    assert info["is_success"] and info["failure"] == ""


def test_unknown_settings_are_refused_when_the_environment_is_made() -> None:
    with pytest.raises(TypeError, match="mug_range"):
        gymnasium.make("sim_tasks/LiftCup-v0", mug_range=0.1)
