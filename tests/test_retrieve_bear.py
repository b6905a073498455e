"""Retrieve Bear: limits of displaced clutter, the effect of the elbow on it, and placements."""

from collections.abc import Iterable

import numpy as np
import pytest
from playing import play

from er_il.spaces.action_space import make_action_space
from sim_tasks.tasks.retrieve_bear import DISPLACED, RetrieveBear

ASIDE = {
    "vase": (0.85, 0.29, 0.0),
    "cactus": (0.85, -0.29, 0.0),
    "lamp": (0.70, 0.28, 0.0),
    "books": (0.70, -0.27, 0.0),
}


@pytest.fixture(scope="module")
def world() -> RetrieveBear:
    return RetrieveBear()


def still(world: RetrieveBear, gripper: float = 1.0) -> np.ndarray:
    return np.append(world.joint_positions, gripper)


def through_task_space(world: RetrieveBear, actions: Iterable[np.ndarray], posture: np.ndarray | None = None) -> str:
    """Outcome of joint commands encoded in task space, which keeps the pose of the hand alone."""
    space = make_action_space("task", world.arm, posture=posture)
    encoded = [space.encode(action[:-1], action[-1]) for action in actions]
    decoded = (space.decode(action, seed=world.joint_positions) for action in encoded)
    return play(world, (np.append(each.q, each.gripper) for each in decoded))


def test_everything_stands_still_by_itself(world: RetrieveBear) -> None:
    before = world.reset(seed=0)[0]["environment_state"]
    assert play(world, [still(world)] * 60) == ""
    after = np.concatenate([world.object_pose(name) for name in world.objects])
    assert after == pytest.approx(before, abs=5e-4)


@pytest.mark.parametrize("name", RetrieveBear.clutter)
def test_a_graze_is_forgiven_and_a_push_is_not(world: RetrieveBear, name: str) -> None:
    for shift, outcome in ((0.8 * DISPLACED, ""), (1.2 * DISPLACED, "clutter_displaced")):
        world.reset(seed=0)
        world.data.joint(name).qpos[1] += shift
        assert play(world, [still(world)] * 10) == outcome
    for degrees, outcome in ((5.0, ""), (30.0, "clutter_tipped")):
        world.reset(seed=0, options={"state": {name: (*world.places[name], 0.0)}})
        half = np.radians(degrees) / 2
        world.data.joint(name).qpos[[2, 3, 4]] += [0.1, np.cos(half) - 1, np.sin(half)]  # clear of the top, leaning
        assert play(world, [still(world)]) == outcome


def test_an_arm_that_runs_into_the_vase_fails(world: RetrieveBear) -> None:
    world.reset(seed=0)
    actions = list(world.leader(0))
    world.reset(seed=0, options={"state": {"vase": (0.40, 0.04, 0.0)}})
    assert play(world, actions) in ("clutter_displaced", "clutter_tipped")


def test_only_the_hands_pose_fails_among_clutter_and_does_without(world: RetrieveBear) -> None:
    world.reset(seed=0)
    actions = list(world.leader(0))
    world.reset(seed=0)
    assert through_task_space(world, actions) in ("clutter_displaced", "clutter_tipped")
    world.reset(seed=0, options={"state": ASIDE})
    assert through_task_space(world, actions) == "success"
    world.reset(seed=0)
    assert through_task_space(world, actions, world.arm.home) == "collision"  # with the wall


def test_a_demonstration_goes_on_beyond_success_and_a_bear_let_go_is_dropped(world: RetrieveBear) -> None:
    world.reset(seed=0, options={"beyond_success": True})
    actions = list(world.leader(0))
    assert play(world, actions[:-5]) == "success"
    assert world.object_pose("bear")[2] > world.support + world.lift_height
    assert play(world, [np.append(actions[-1][:-1], 1.0)] * 20) == "dropped"


def test_a_bear_that_is_held_but_not_lifted_is_not_retrieved(world: RetrieveBear) -> None:
    world.reset(seed=0)
    actions = list(world.leader(0))
    closed = next(i for i, action in enumerate(actions) if action[-1] == 0.0)
    assert play(world, [*actions[:closed], *[actions[closed + 5]] * world.max_steps]) == "timeout"


def test_a_hand_that_closes_beside_the_bear_misses(world: RetrieveBear) -> None:
    world.reset(seed=0)
    assert play(world, [still(world, 0.0)] * world.max_steps) == "missed_grasp"


def test_things_stand_within_the_declared_ranges(world: RetrieveBear) -> None:
    states = np.array([world.reset(seed=seed)[0]["environment_state"] for seed in range(200)]).reshape(200, -1, 7)
    for i, name in enumerate(world.objects):
        sides = np.array([0.10, 0.065] if name == "bear" else [0.03, 0.03])
        offsets = states[:, i, :2] - world.places[name]
        assert np.all(np.abs(offsets) <= sides / 2 + 1e-6)
        assert np.all(np.ptp(offsets, axis=0) > 0.9 * sides)
        yaw = np.degrees(2 * np.arctan2(states[:, i, 5], states[:, i, 6]))
        limit = 0.0 if name == "bear" else 15.0
        assert np.all(np.abs(yaw) <= limit + 1e-3)
        assert np.ptp(yaw) >= 1.8 * limit


@pytest.mark.parametrize("x", [0.61, 0.71])
@pytest.mark.parametrize("y", [-0.0325, 0.0325])
def test_the_leader_retrieves_from_every_corner(world: RetrieveBear, x: float, y: float) -> None:
    world.reset(seed=0, options={"state": {"bear": (x, y, 0.0)}})
    assert play(world, world.leader(0)) == "success"


def test_a_viewer_sees_a_bear_of_ellipsoids(world: RetrieveBear) -> None:
    world.reset(seed=0)
    parts = [shape for shape in world.scene_geometry() if shape.parent == "bear"]
    assert sum(shape.kind == "ellipsoid" for shape in parts) > 10
    assert all(len(shape.size) == 3 for shape in parts if shape.kind == "ellipsoid")


def test_the_second_wrist_camera_sees_the_scene_from_the_other_side() -> None:
    world = RetrieveBear(cameras=("wrist", "wrist2"), image_size=64)
    pixels = world.reset(seed=0)[0]["pixels"]
    for action in list(world.leader(0))[:60]:
        pixels = world.step(action)[0]["pixels"]
    one, other = pixels["wrist"].astype(float), pixels["wrist2"].astype(float)
    assert one.std() > 10 and other.std() > 10
    assert np.abs(one - other).mean() > 10
    world.close()
