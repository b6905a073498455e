"""Batches of actions: the single decoder's solutions and statuses, on NumPy arrays and PyTorch tensors."""

import numpy as np
import pytest
import torch

from er_il import Arm, Status
from er_il.kinematics.redundancy import JointAngle
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.base import ArmSpace, Array
from er_il.spaces.registry import make_arm_space
from er_il.support.errors import ShapeError

PANDA, XARM7, PANDA8 = Arm.preset("panda"), Arm.preset("xarm7"), Arm.preset("panda8")
AGREES = 1e-6  # [rad]
KINDS = ("joint", "task", "erj", "era", "era@stereo", "erx")


def sample(space: ArmSpace, count: int, reach: float, seed_error: float = 0.1) -> tuple[Array, Array, Array]:
    """Configurations within a share of the limits, actions that encode them, and seeds around them."""
    arm, rng = space.arm, np.random.default_rng(0)
    middle, half = (arm.upper + arm.lower) / 2, (arm.upper - arm.lower) / 2
    q = middle + reach * half * rng.uniform(-1, 1, (count, arm.dof))
    return q, np.array([space.encode(each) for each in q]), q + rng.uniform(-seed_error, seed_error, q.shape)


CASES = [(arm, kind) for arm in (PANDA, XARM7, PANDA8) for kind in KINDS if "era" not in kind or arm.redundancy == 1]


@pytest.mark.parametrize(("arm", "kind"), CASES, ids=lambda value: getattr(value, "name", value))
def test_a_batch_is_the_single_decoders_solutions_also_near_limits_and_folds(arm: Arm, kind: str) -> None:
    space = make_arm_space(kind, arm)
    _, actions, seeds = sample(space, 150, reach=1.0)
    together = space.decode_batch(actions, seeds)
    single = [space.decode(*each) for each in zip(actions, seeds, strict=True)]
    assert together.status.tolist() == [each.status for each in single]
    solved = together.status == Status.OK
    assert solved.sum() > 100
    # Near a singularity of the pose alone, rounding decides where on the self-motion the program ends.
    agrees = 1e-5 if kind == "task" else AGREES
    np.testing.assert_allclose(together.q[solved], np.array([each.q for each in single])[solved], rtol=0, atol=agrees)
    assert together.pos_err.max() <= max(each.pos_err for each in single) + AGREES


@pytest.mark.parametrize("kind", ["erj", "era"])
def test_actions_that_are_not_ok_have_their_reasons(kind: str) -> None:
    space = make_arm_space(kind, PANDA)
    q, actions, seeds = sample(space, 5, reach=0.3)
    actions[0, 0] = np.nan
    actions[1, 3:7] = 0.0
    actions[2, :3] = 2.0
    actions[3, 7] = 9.0 if kind == "erj" else actions[3, 7] + 2 * np.pi  # beyond the joint's limit; another turn
    together = space.decode_batch(actions, seeds)
    others = [Status.LIMIT if kind == "erj" else Status.OK, Status.OK]
    assert together.status.tolist() == [Status.INVALID, Status.INVALID, Status.UNREACHABLE, *others]
    np.testing.assert_array_equal(together.q[:2], PANDA.within_limits(seeds[:2]))
    assert np.all((together.q >= PANDA.lower) & (together.q <= PANDA.upper))
    np.testing.assert_allclose(together.q[4], q[4], atol=AGREES)


@pytest.mark.parametrize("kind", [*KINDS, "delta_joint", "delta_erj"])
def test_tensors_give_what_arrays_give(kind: str) -> None:
    space = make_arm_space(kind, PANDA)
    q, actions, seeds = sample(space, 40, reach=0.7, seed_error=0.03)
    expected = space.decode_batch(actions, seeds)
    decoded = space.decode_batch(torch.tensor(actions), torch.tensor(seeds))
    assert decoded.q.dtype == torch.float64
    np.testing.assert_allclose(decoded.q.numpy(), expected.q, rtol=0, atol=1e-9)
    assert decoded.status.tolist() == expected.status.tolist()
    if not kind.startswith("delta"):
        path = np.linspace(q[0], q[1], 30)
        np.testing.assert_array_equal(space.encode(torch.tensor(path)).numpy(), space.encode(path))


@pytest.mark.parametrize("kind", ["erj", "era"])
@pytest.mark.parametrize("rotation", ["quat", "rot6d"])
def test_the_gradient_is_that_of_the_solution(kind: str, rotation: str) -> None:
    space = make_arm_space(kind, PANDA, rotation=rotation)
    _, actions, seeds = sample(space, 4, reach=0.4, seed_error=0.02)
    actions[3, :3] = 5.0  # out of reach: no gradient, and none for the others' sake
    weights = np.random.default_rng(1).normal(size=(4, 7))

    def loss(values: Array) -> float:
        return float((space.decode_batch(values, seeds).q * weights).sum())

    given = torch.tensor(actions, requires_grad=True)
    (space.decode_batch(given, torch.tensor(seeds)).q * torch.tensor(weights)).sum().backward()
    assert given.grad is not None
    assert (given.grad[3] == 0).all()
    step = 1e-5
    for row, column in np.ndindex(3, space.dim):
        change = np.zeros_like(actions)
        change[row, column] = step
        slope = (loss(actions + change) - loss(actions - change)) / (2 * step)
        assert given.grad[row, column].item() == pytest.approx(slope, rel=1e-4, abs=1e-5)


def test_deltas_count_from_the_last_commands() -> None:
    space = make_arm_space("delta_erj", PANDA)
    path = PANDA.home + np.linspace(0.0, 0.2, 12)[:, None] * np.ones(7)
    decoded = space.decode_batch(space.encode(path)[1:], path[:-1], path[:-1])
    np.testing.assert_allclose(decoded.q, path[1:], atol=AGREES)


def test_kinematics_of_many_configurations_is_that_of_each() -> None:
    for arm in (PANDA, XARM7, PANDA8):
        kinematics, q = kinematics_of(arm), np.random.default_rng(2).uniform(arm.lower, arm.upper, (30, arm.dof))
        np.testing.assert_allclose(kinematics.fk_batch(q), [kinematics.fk(each) for each in q], atol=1e-12)
        np.testing.assert_allclose(kinematics.jacobians(q), [kinematics.jacobian(each) for each in q], atol=1e-12)
        redundancy = JointAngle(arm, arm.redundant)
        expected = [kinematics.conditioning(each, redundancy) for each in q]
        np.testing.assert_allclose(kinematics.conditionings(q, redundancy), expected, atol=1e-9)


def test_shapes_are_checked() -> None:
    space = make_arm_space("erj", PANDA)
    with pytest.raises(ShapeError, match=r"erj actions .*\(N, 8\)"):
        space.decode_batch(np.zeros((3, 7)), np.zeros((3, 7)))
    with pytest.raises(ShapeError, match=r"The seeds .*\(3, 7\)"):
        space.decode_batch(np.zeros((3, 8)), np.zeros((2, 7)))
