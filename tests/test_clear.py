"""The decoder ``task-clear``: the pose is kept, the elbow keeps clear of the world."""

import shutil
from itertools import islice
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from lerobot.datasets.io_utils import load_stats
from numpy.typing import NDArray

from er_il.arms.arm import Arm
from er_il.datasets.dataset import Dataset
from er_il.datasets.normalisation import hide_joints
from er_il.datasets.schema import STATE
from er_il.envs import lerobot_plugin
from er_il.envs.decoders import DECODERS, Decoder
from er_il.envs.lerobot_plugin import ErIlEnvConfig
from er_il.envs.side_by_side import BatchDecodingEnv
from er_il.envs.tasks import task_id
from er_il.envs.wrapper import ActionSpaceEnv, make_action_space_env
from er_il.experiments.grid import Cell, Grid
from er_il.experiments.jobs import HideJoints
from er_il.experiments.plan import Plan
from er_il.kinematics.self_motion import tangents, walk
from er_il.kinematics.solver import Status, kinematics_of
from er_il.spaces.clear import ENOUGH, cost, keeping_clear
from er_il.spaces.registry import make_arm_space
from er_il.support.errors import ErIlError
from er_il.support.resources import data_dir
from sim_tasks.tasks.arm_task import ArmTask

PANDA = Arm.preset("panda")
NEAR = np.array([1.25, -1.0, -0.3, -1.86, -1.18, 1.85, 1.44])  # [rad]

Vector = NDArray[np.float64]


def held(env: ActionSpaceEnv, steps: int) -> tuple[list[Vector], list[float]]:
    """Commands and costs while an environment is told to keep the hand where it is."""
    env.reset(seed=0)
    assert isinstance(env.unwrapped, ArmTask)
    action = np.append(env.space.encode(env.world.joint_positions), 1.0).astype(np.float32)
    commands, costs = [], []
    for _ in range(steps):
        *_, info = env.step(action)
        assert info["decode_status"] == "ok"
        commands.append(info["command"])
        costs.append(cost(env.unwrapped.clearances(info["command"], ENOUGH)))
    return commands, costs


@pytest.mark.parametrize("name", ["panda", "panda8"])
def test_walks_along_the_self_motion_keep_the_pose(name: str) -> None:
    arm = Arm.preset(name)
    kinematics = kinematics_of(arm)
    T, directions = kinematics.fk(arm.home), tangents(kinematics.jacobian(arm.home))
    assert directions.shape == (2 * arm.redundancy, arm.dof)
    assert np.linalg.matrix_rank(directions, tol=1e-6) == arm.redundancy
    np.testing.assert_allclose(kinematics.jacobian(arm.home) @ directions.T, 0.0, atol=1e-7)
    for tangent in directions:
        way = [arm.home, *islice(walk(kinematics, T, arm.home, tangent, 0.2), 100)]
        assert 5 < len(way) < 100  # to a joint's limit
        for q in way:
            assert np.all((arm.lower <= q) & (q <= arm.upper))
            assert max(kinematics.pose_error(T, q)) < 2e-3
        steps = np.diff(way, axis=0)
        np.testing.assert_allclose(np.linalg.norm(steps, axis=1), 0.2, atol=0.05)
        assert np.all(np.sum(steps[1:] * steps[:-1], axis=1) > 0)  # straight ahead


@pytest.mark.parametrize("arm", ["panda", "panda8"])
def test_the_arm_clears_the_world_while_the_hand_stays(arm: str) -> None:
    near, clear = (
        make_action_space_env("reach_cup", DECODERS[name], arm=arm) for name in ("task-nearest", "task-clear")
    )
    stays, costs_before = held(near, 12)
    commands, costs = held(clear, 12)
    assert costs_before[0] > 0.0
    assert costs[-1] < 0.7 * costs_before[-1]
    assert np.ptp(stays, axis=0).max() < 0.01 < np.ptp(commands, axis=0).max()
    T = clear.space.fk(stays[0])
    for q in commands:
        assert max(clear.space.kinematics.pose_error(T, q)) < 2e-3
    assert np.abs(np.diff(commands, axis=0) / clear.space.arm.velocity).max() <= 0.05 + 1e-9  # [s] a period's way
    again, _ = held(make_action_space_env("reach_cup", DECODERS["task-clear"], arm=arm), 12)
    np.testing.assert_array_equal(again, commands)


def test_deltas_of_task_space_clear_the_world_too() -> None:
    env = make_action_space_env("reach_cup", Decoder("delta_task", "clear"))
    env.reset(seed=0)
    assert isinstance(env.unwrapped, ArmTask)
    before = cost(env.unwrapped.clearances(env.world.joint_positions, ENOUGH))
    for _ in range(10):
        env.step(np.append(np.zeros(6), 1.0).astype(np.float32))
    assert cost(env.unwrapped.clearances(env.world.joint_positions, ENOUGH)) < 0.7 * before


def test_clearances_are_the_true_distances_of_links_that_the_pose_leaves_open() -> None:
    world = gymnasium.make(task_id("reach_cup")).unwrapped
    assert isinstance(world, ArmTask)
    world.reset(seed=0)
    before = world.data.qpos.copy()
    q = world.joint_positions
    free = world.clearances(q, 0.3)
    assert free.shape == (6,)  # links 1 to 6: the seventh is fixed to the hand
    assert np.all(free > 0.0) and free.max() <= 0.3
    np.testing.assert_array_equal(world.clearances(q, 0.05), np.minimum(free, 0.05))
    leaning = np.array([0.0, -1.7, 0.0, -2.0, 0.0, 2.0, 0.8])  # the upper arm leans back into the wall
    assert world.clearances(leaning, 0.3).min() < 0.0
    np.testing.assert_array_equal(world.data.qpos, before)  # the world itself stays as it is
    cup = world.data.joint("cup")
    cup.qpos[:3] = kinematics_of(world.arm).frame_pose(q, "panda_link4")[:3, 3]
    np.testing.assert_array_equal(world.clearances(q, 0.3), free)  # what the hand is to take is no obstacle


def test_it_looks_beyond_a_hump_but_not_through_a_contact() -> None:
    def world(hump: float) -> Vector:
        """Distances by the first joint's angle: near here, nearer a little on, clear beyond; worse the other way."""
        here = NEAR[0]
        return np.array([[here - 4, 0.0], [here, 0.05], [here + 0.3, hump], [here + 0.8, ENOUGH], [here + 4, ENOUGH]])

    for hump, moves in ((0.02, True), (-0.01, False)):
        points = world(hump)
        space = keeping_clear(
            make_arm_space("task", PANDA), lambda q, most, at=points: np.interp(q[:1], at[:, 0], at[:, 1])
        )
        q = NEAR
        for _ in range(30):
            decoded = space.decode(space.encode(NEAR), q)
            assert decoded.status is Status.OK
            q = decoded.q
        assert (q[0] > NEAR[0] + 0.7) == moves
        if not moves:
            np.testing.assert_allclose(q, NEAR, atol=0.05)


def test_clear_of_everything_it_is_the_nearest() -> None:
    plain = make_arm_space("task", PANDA)
    space = keeping_clear(plain, lambda q, most: np.full(6, most))
    action = plain.encode(NEAR + 0.03)
    np.testing.assert_array_equal(space.decode(action, NEAR).q, plain.decode(action, NEAR).q)
    assert space.spec() == plain.spec()  # the same policies
    batch = space.decode_batch(np.array([action, action]), np.array([NEAR, NEAR]))
    np.testing.assert_array_equal(batch.q[1], space.decode(action, NEAR).q)


def test_each_environment_decodes_for_its_own_world(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lerobot_plugin, "BATCH_FROM", 2)
    for resolution, batched in (("nearest", True), ("clear", False)):
        config = ErIlEnvConfig(task="lift_cup", action_space="task", resolution=resolution)
        vector = config.create_envs(2)[config.type][0]
        assert isinstance(vector, BatchDecodingEnv) is batched
        vector.close()


def test_where_it_cannot_work_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(
        ErIlError, match=r"^The resolution clear is for task space: erj leaves it nothing to resolve\.$"
    ):
        ErIlEnvConfig(action_space="erj", resolution="clear")

    monkeypatch.delattr(ArmTask, "clearances")
    world = gymnasium.make(task_id("lift_cup"))
    with pytest.raises(ErIlError, match=r"LiftCup-v0 is no environment for task-clear, .*: it lacks clearances\.$"):
        DECODERS["task-clear"].layout_in(world)
    assert DECODERS["task-nearest"].works_in(world) and not DECODERS["task-clear"].works_in(world)


def test_a_grid_can_hide_the_joints_from_the_policies_of_every_space(tmp_path: Path) -> None:
    grid = Grid.from_file(data_dir("configs") / "joints_unseen.yaml")
    cells = [Cell("reach_cup", decoder, 32) for decoder in ("era", "erx")]
    unseen, seen = (
        [Plan(each, tmp_path).training(cell, 0) for cell in cells] for each in (grid, grid.replaced(joints_seen=True))
    )
    for hidden, plain in zip(unseen, seen, strict=True):
        (hiding,) = hidden.needs
        assert isinstance(hiding, HideJoints) and hiding.needs == plain.needs and hidden.path != plain.path
        assert hiding.space == hidden.space and hiding.dataset(hiding.space) != plain.needs[0].dataset(plain.space)


def test_its_policies_in_the_table_are_of_task_space_and_do_not_see_the_joints(reach_cup: Path, tmp_path: Path) -> None:
    plan = Plan(Grid.from_file(data_dir("configs") / "table1.yaml"), tmp_path)
    clear, nearest = (plan.training(Cell("reach_cup", name, 32), 0) for name in ("task-clear", "task-nearest"))
    (hiding,) = clear.needs
    assert isinstance(hiding, HideJoints) and clear.space == nearest.space == "task"
    assert clear.path != nearest.path and hiding.needs == nearest.needs
    shutil.copytree(reach_cup / "erj", tmp_path / "erj")
    before = load_stats(tmp_path / "erj")
    hide_joints(tmp_path / "erj")
    after, dataset = load_stats(tmp_path / "erj"), Dataset(tmp_path / "erj")
    assert before is not None and after is not None
    scaled = (dataset.vectors(STATE) - after[STATE]["mean"]) / after[STATE]["std"]
    seen = [name for name, column in zip(dataset.names(STATE), scaled.T, strict=True) if np.abs(column).max() > 1e-3]
    assert seen == ["gripper", "ee.x", "ee.y", "ee.z", "ee.qx", "ee.qy", "ee.qz", "ee.qw"]
    assert np.array_equal(after[STATE]["std"][7:], before[STATE]["std"][7:])
