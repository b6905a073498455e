"""Remove Cup and Reach & Remove Cup: success outside the cabinet, and the failures before it."""

import gymnasium
import numpy as np
import pytest

import sim_tasks  # noqa: F401
from er_il.kinematics.redundancy import JointAngle
from er_il.kinematics.solver import kinematics_of
from sim_tasks.tasks.cabinet_cup import OUTSIDE
from sim_tasks.tasks.reach_remove_cup import ReachRemoveCup
from sim_tasks.tasks.remove_cup import RemoveCup

TASKS = (RemoveCup, ReachRemoveCup)


def episode(task: type[RemoveCup]) -> tuple[gymnasium.Env, RemoveCup, np.ndarray]:
    """An environment reset, its world, and the leader's actions (T, n+1)."""
    env = gymnasium.make(f"sim_tasks/{task.__name__}-v0")
    world = env.unwrapped
    assert isinstance(world, task)
    env.reset(seed=0)
    return env, world, np.array(list(world.leader(0)))


def play(env: gymnasium.Env, actions: np.ndarray) -> tuple[bool, str]:
    """Step until the episode ends, at the end of the actions with the last one. Returns success and failure."""
    index = 0
    while True:
        _, _, terminated, truncated, info = env.step(actions[min(index, len(actions) - 1)].astype(np.float32))
        index += 1
        if terminated or truncated:
            return info["is_success"], info["failure"]


def still(q: np.ndarray, gripper: float) -> np.ndarray:
    return np.append(q, gripper)[None]


@pytest.mark.parametrize("task", TASKS)
def test_success_is_a_cup_wholly_out_that_both_fingers_hold_upright(task: type[RemoveCup]) -> None:
    env, world, actions = episode(task)
    assert play(env, actions) == (True, "")
    x, y, z, *_ = world.object_pose("cup")
    assert x + world.cup.foot_radius < world.cabinet.front - OUTSIDE
    assert np.linalg.norm([x, y, z + 0.09] - world.ee_pose[:3, 3]) < 0.03  # by its stem, not slipped
    assert world._upright() and world._held()


@pytest.mark.parametrize("task", TASKS)
def test_a_cup_lifted_inside_or_halfway_out_is_not_removed(task: type[RemoveCup]) -> None:
    env, world, actions = episode(task)
    x = np.array([kinematics_of(world.arm).fk(action[:-1])[0, 3] for action in actions])
    grasp = int(np.argmin(actions[:, -1]))  # the gripper's first closed step
    front = world.cabinet.front
    for stop in (0.65, front):  # lifted in the depth; its axis in the plane of the front
        env.reset(seed=0)
        carried = int(np.argmax(x[grasp:] < stop))
        assert play(env, actions[: grasp + carried]) == (False, "not_removed")
        assert world._held() and world._lifted() and not world._outside()


@pytest.mark.parametrize("task", TASKS)
def test_a_grasp_without_retreat_is_not_removed_and_a_fist_misses(task: type[RemoveCup]) -> None:
    env, world, actions = episode(task)
    resting = int(np.argmin(actions[:, -1])) + 10
    assert play(env, actions[:resting]) == (False, "not_removed")
    assert world._held() and not world._lifted()
    env.reset(seed=0)
    start = world.joint_positions
    assert play(env, still(start, 0.0)) == (False, "missed_grasp")
    env.reset(seed=0)
    assert play(env, still(start, 1.0)) == (False, "timeout")


def test_a_cup_let_go_outside_is_dropped() -> None:
    env, world, actions = episode(RemoveCup)
    out = next(i for i, action in enumerate(actions) if kinematics_of(world.arm).fk(action[:-1])[0, 3] < 0.355)
    actions[out:, -1] = 1.0
    assert play(env, actions) == (False, "dropped")


@pytest.mark.parametrize(("task", "failure"), [(RemoveCup, "collision"), (ReachRemoveCup, "collision_removing")])
def test_an_elbow_left_up_hits_the_wall_on_the_way_out(task: type[RemoveCup], failure: str) -> None:
    env, world, actions = episode(task)
    kinematics, grasp = kinematics_of(world.arm), int(np.argmin(actions[:, -1]))
    q = actions[grasp, :-1]
    for action in actions[grasp:]:
        q = kinematics.solve(kinematics.fk(action[:-1]), q, JointAngle(world.arm, (world.arm.joints[0],)), [0.1]).q
        action[:-1] = q
    assert play(env, actions) == (False, failure)


def test_an_elbow_left_out_hits_the_cabinet_on_the_way_in() -> None:
    env, world, actions = episode(ReachRemoveCup)
    kinematics, q = kinematics_of(world.arm), world.joint_positions
    for action in actions:
        q = kinematics.solve(kinematics.fk(action[:-1]), q, JointAngle(world.arm, (world.arm.joints[0],)), [1.2]).q
        action[:-1] = q
    assert play(env, actions) == (False, "collision_reaching")
