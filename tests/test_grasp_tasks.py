"""Take Lid Off Saucepan, Pick and Lift, Pick Up Cup: judgement, grasps and placements."""

import gymnasium
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er_il.envs import make_rl_env
from sim_tasks.tasks.carry_task import ARRIVED, MARK, GraspTask
from sim_tasks.tasks.object_task import WIDTH
from sim_tasks.tasks.pick_and_lift import LEAST, PickAndLift
from sim_tasks.tasks.pick_up_cup import LEFT
from sim_tasks.tasks.rewards import closeness
from sim_tasks.tasks.take_lid_off_saucepan import LIFT, SAUCEPAN, TakeLidOffSaucepan
from sim_tasks.world.blocks import BLOCK
from sim_tasks.world.contact import touching
from sim_tasks.world.robot import FINGER_TRAVEL
from sim_tasks.world.saucepan import KNOB_MIDDLE, KNOB_RADIUS
from sim_tasks.world.tableware import CUP_RADIUS

TASKS = {name: f"sim_tasks/{name}-v0" for name in ("TakeLidOffSaucepan", "PickAndLift", "PickUpCup")}


def make(task: str, arm: str = "panda") -> GraspTask:
    world = gymnasium.make(TASKS[task], arm=arm).unwrapped
    assert isinstance(world, GraspTask)
    return world


def hold(world: GraspTask, lifted: float = 0.0) -> dict[str, float]:
    """Demonstrate until the target is held and lifted by so much [m]; the terms of the reward there."""
    world.reset(seed=0)
    height = world.position(world.target)[2]
    for action in world.leader(0):
        info = world.step(action)[4]
        if world.held == world.target and world.position(world.target)[2] >= height + lifted:
            return info["reward_terms"]
    raise AssertionError("never held and lifted")


@pytest.mark.parametrize("task", TASKS)
def test_a_grasp_completes_reaching_and_opening_the_fingers_loses_it_all(task: str) -> None:
    world = make(task)
    weights = world.reward.weights
    terms = hold(world)
    assert terms["reach"] == weights["reach"] and terms["lift"] < 0.7 * weights["lift"] and terms["success"] == 0.0
    terms = hold(world, lifted=0.06)
    assert 0.0 < terms["lift"] < weights["lift"] and terms["success"] == 0.0
    open_hand = np.append(world.joint_positions, 1.0)
    terms = [world.step(open_hand)[4]["reward_terms"] for _ in range(10)][-1]
    assert not world.grasped and terms["lift"] == terms["success"] == 0.0
    assert 0.0 < terms["reach"] < weights["reach"]


@pytest.mark.parametrize(
    ("task", "radius"), [("TakeLidOffSaucepan", KNOB_RADIUS), ("PickAndLift", BLOCK / 2), ("PickUpCup", CUP_RADIUS)]
)
def test_fingers_that_close_at_once_stop_at_the_thing_and_hold_it_where_it_was_grasped(
    task: str, radius: float
) -> None:
    world = make(task)
    hold(world, lifted=0.05)
    assert world.gripper_opening == pytest.approx(radius / FINGER_TRAVEL, abs=0.1)
    assert np.linalg.norm(world.tip - world.grasp_point) < 0.01


@pytest.mark.parametrize("task", ["TakeLidOffSaucepan", "PickAndLift"])
def test_what_is_at_the_mark_without_being_held_is_no_success(task: str) -> None:
    world = make(task)
    hold(world)
    marked = world.model.body(MARK).mocapid[0]
    for offset, success in ((0.9 * ARRIVED, True), (1.1 * ARRIVED, False)):
        world.data.mocap_pos[marked] = world.grasp_point + np.array([0.0, offset, 0.0])
        info = world.step(np.append(world.joint_positions, 0.0))[4]
        assert (info["reward_terms"]["success"] > 0) is success
    world.data.mocap_pos[marked] = world.grasp_point
    info = world.step(np.append(world.joint_positions, 1.0))[4]
    assert info["reward_terms"]["lift"] == info["reward_terms"]["success"] == 0.0


def test_a_cup_that_is_knocked_away_and_another_cup_that_is_taken_are_no_success() -> None:
    world = make("PickUpCup")
    world.reset(seed=0)
    x, y, _ = world.position("red_cup")
    world.data.joint("red_cup").qpos[:3] = x + 2 * LEFT, y, 0.0
    info = world.step(np.append(world.joint_positions, 1.0))[4]
    assert info["reward_terms"]["lift"] == info["reward_terms"]["success"] == 0.0
    world.reset(seed=0, options={"state": {"red_cup": (0.4, 0.3, 0.0), "blue_cup": (x, y, 0.0)}})
    twin = make("PickUpCup")
    twin.reset(seed=0)
    # The same start, with the other cup where the red one was.
    info = [world.step(action)[4] for action in twin.leader(0)][-1]
    assert world.held == "blue_cup" and not info["is_success"]
    assert info["reward_terms"]["lift"] == info["reward_terms"]["success"] == 0.0


@pytest.mark.parametrize("arm", TakeLidOffSaucepan.arms)
def test_the_lid_lies_still_on_its_pan_and_the_mark_is_above_it(arm: str) -> None:
    world = make("TakeLidOffSaucepan", arm=arm)
    for seed in range(3):
        world.reset(seed=seed)
        start = world.object_pose("lid")
        for _ in range(20):
            world.step(np.append(world.nominal_start, 1.0))
        assert np.allclose(world.object_pose("lid"), start, atol=1e-3)
        assert np.allclose(world.position(SAUCEPAN)[:2], world.position("lid")[:2], atol=1e-3)
        assert np.allclose(world.position(MARK) - world.grasp_point, (0.0, 0.0, LIFT), atol=2e-3)


def test_a_tilted_hand_is_farther_from_a_block_than_one_that_points_down() -> None:
    world = make("PickAndLift")
    world.reset(seed=0)

    def reach(offset: tuple[float, float, float], tilt: float) -> float:
        world.data.xpos[world._tip] = world.grasp_point + offset
        world.data.xmat[world._tip] = Rotation.from_euler("x", np.pi + tilt).as_matrix().ravel()
        return world._progress()["reach"]

    assert reach((0.0, 0.0, 0.0), 0.0) == pytest.approx(1.0)
    assert reach((0.0, 0.0, 0.1), 0.0) == pytest.approx(closeness(0.1, WIDTH))
    away = [reach((0.03, 0.0, 0.0), tilt) for tilt in (0.0, 0.3, 0.6, np.pi)]
    assert away == sorted(away, reverse=True) and away[2] < 0.95 * away[0]


def test_blocks_leave_room_for_the_fingers_and_the_mark_is_above_the_bench() -> None:
    world = make("PickAndLift")
    heights = []
    for seed in range(30):
        world.reset(seed=seed)
        places = np.array([world.position(name)[:2] for name in PickAndLift.graspable])
        gaps = [np.linalg.norm(places[i] - places[j]) for i, j in ((0, 1), (0, 2), (1, 2))]
        assert min(gaps) > LEAST
        heights.append(world.position(MARK)[2])
    assert 0.15 <= min(heights) < 0.2 and 0.3 < max(heights) <= 0.35


@pytest.mark.parametrize(
    ("away", "opening", "taken"), [(0.0, 1.0, True), (0.02, 1.0, True), (0.05, 1.0, False), (0.0, 0.0, False)]
)
def test_what_is_between_the_fingers_is_taken_as_they_begin_to_close(away: float, opening: float, taken: bool) -> None:
    world = make("TakeLidOffSaucepan")
    world.reset(seed=0)
    held = np.append(world.nominal_start, opening)
    world.step(held)  # fingers that were told to close before do not begin to
    world.data.joint("lid").qpos[:3] = world.tip - (0.0, away, KNOB_MIDDLE)
    mujoco.mj_forward(world.model, world.data)
    world.step(np.append(world.nominal_start, 0.0))
    assert world.grasped == taken


@pytest.mark.parametrize(("offset", "taken"), [((0.0, 0.0, 0.032), True), ((-0.085, 0.0, 0.0), False)])
def test_the_lid_is_taken_by_its_knob(offset: tuple[float, float, float], taken: bool) -> None:
    env = make_rl_env("take_lid_off_saucepan", "task")
    env.reset(seed=0)
    world = env.world
    assert isinstance(world, TakeLidOffSaucepan)
    target = world.position("lid") + offset
    for opening in (1.0, -1.0):
        for _ in range(20):
            away = target - world.tip
            action = np.array([*np.clip(away / 0.05, -1, 1), 0, 0, 0, opening], np.float32)
            env.step(action)
    lid = {world.model.body("lid").id}
    assert all(touching(world.model, world.data, finger, lid) for finger in world._fingers)  # of the rim, too
    assert world.grasped == taken
    env.close()
