"""Push Button Elbow: who may press, where the button stands, and that it springs back."""

import numpy as np
import pytest
from playing import play

from er_il.kinematics.redundancy import JointAngle
from er_il.kinematics.solver import Status, kinematics_of
from er_il.spaces.action_space import make_action_space
from sim_tasks.leader.scripts.button import DEPTH
from sim_tasks.tasks.push_button_elbow import BUTTON, PEDESTAL, PRESSED, PushButtonElbow

STEPS = 25  # control steps from one of the hand's places to the next


@pytest.fixture(scope="module")
def world() -> PushButtonElbow:
    return PushButtonElbow()


def hand_through(world: PushButtonElbow, *places: tuple[float, float, float]) -> list[np.ndarray]:
    """Joint targets that take a fist that points down through places [m], the elbow as it is."""
    kinematics, q = kinematics_of(world.arm), world.joint_positions
    T = np.diag([1.0, -1.0, -1.0, 1.0])
    targets = []
    for place in places:
        T[:3, 3] = place
        ik = kinematics.solve(T, q, JointAngle(world.arm, (world.arm.redundant[-1],)), [q[0]])
        assert ik.status is Status.OK
        targets += [np.append(q + share * (ik.q - q), 0.0) for share in np.arange(1, STEPS + 1) / STEPS]
        q = ik.q
    return [*targets, *targets[-1:] * STEPS]


def test_the_demonstration_goes_on_pressing_and_the_cap_springs_back(world: PushButtonElbow) -> None:
    world.reset(seed=0)
    actions = list(world.leader(0))
    assert play(world, actions) == "success"
    for action in actions:  # a recording goes on after success: the leader's end is reached, and held
        world.step(action)
    assert world.travel == pytest.approx(DEPTH, abs=0.004)
    assert world.travel > PRESSED + 0.004, "the leader must press well beyond what counts"
    for action in actions[::-1]:
        world.step(action)
    assert world.travel == pytest.approx(0.0, abs=1e-4)


def test_the_hand_cannot_press_it(world: PushButtonElbow) -> None:
    world.reset(seed=0, options={"state": {BUTTON: (0.5, 0.0, 0.0)}})
    assert play(world, hand_through(world, (0.5, 0.0, 0.50), (0.5, 0.0, 0.33))) == "wrong_link"


def test_running_into_the_pedestal_is_a_collision(world: PushButtonElbow) -> None:
    world.reset(seed=0, options={"state": {BUTTON: (0.5, 0.2, 0.0)}})
    assert play(world, hand_through(world, (0.5, -0.1, 0.08), (0.5, 0.25, 0.08))) == "collision"


def test_standing_still_has_not_pressed_it(world: PushButtonElbow) -> None:
    world.reset(seed=0)
    assert play(world, [np.append(world.joint_positions, 0.0)] * world.max_steps) == "not_pressed"


@pytest.mark.parametrize("posture", [False, True])
def test_the_hands_pose_says_nothing_of_the_elbow(world: PushButtonElbow, posture: bool) -> None:
    """A demonstration encoded in task space never lowers the elbow; encoded in ERJ, it does."""
    task = make_action_space("task", world.arm, posture=world.arm.home if posture else None)
    for space, outcome in ((task, ""), (make_action_space("erj", world.arm), "success")):
        world.reset(seed=0)
        encoded = [space.encode(action[:-1], action[-1]) for action in world.leader(0)]
        decoded = (space.decode(action, seed=world.joint_positions) for action in encoded)
        assert play(world, (np.append(each.q, each.gripper) for each in decoded)) == outcome
        assert (world.travel > PRESSED) == bool(outcome)


def test_the_button_stands_in_its_rectangle_or_where_it_is_put(world: PushButtonElbow) -> None:
    places = np.array([world.reset(seed=seed)[0]["environment_state"][:2] for seed in range(200)])
    assert np.all(np.abs(places - world.centre) <= np.array([0.10, 0.01]) / 2 + 1e-6)
    assert np.all(np.ptp(places, axis=0) > 0.9 * np.array([0.10, 0.01]))
    pose = world.reset(seed=0, options={"state": {BUTTON: (0.17, -0.26, np.pi / 2)}})[0]["environment_state"]
    expected = [0.17, -0.26, world.button.rest, 0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]
    assert pose == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("dx", [-0.05, 0.05])
@pytest.mark.parametrize("dy", [-0.005, 0.005])
def test_the_leader_presses_in_every_corner(world: PushButtonElbow, dx: float, dy: float) -> None:
    x, y = world.centre
    world.reset(seed=0, options={"state": {BUTTON: (x + dx, y + dy, 0.0)}})
    assert play(world, world.leader(0)) == "success"


def test_a_viewer_sees_the_cap_go_down_and_the_pedestal_under_it(world: PushButtonElbow) -> None:
    world.reset(seed=0, options={"state": {BUTTON: (0.17, -0.26, 0.0)}})
    shapes = {shape.name: shape for shape in world.scene_geometry()}
    assert shapes[f"{BUTTON}_cap"].parent == BUTTON
    housing = shapes[f"{PEDESTAL}_housing"]
    assert (housing.parent, *housing.T_parent_shape[:2, 3]) == ("", 0.17, -0.26)
    assert play(world, world.leader(0)) == "success"
    assert world.object_pose(BUTTON)[2] == pytest.approx(world.button.rest - world.travel)
