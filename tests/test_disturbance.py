import numpy as np
import pytest

from er_il.datasets.disturbance import CALM_AFTER, CALM_BEFORE, disturbances

PERIOD, DEVIATION, CLOSES = 0.05, 0.01, 4000  # [s], [rad], step


def pushes(seed: int, gripper: np.ndarray) -> np.ndarray:
    script = np.column_stack([np.zeros((len(gripper), 7)), gripper])
    drawn = disturbances(script, [7], DEVIATION, PERIOD, np.random.default_rng(seed))
    assert not np.any(drawn[:, 7])  # the gripper is not pushed
    return drawn[:, :7]


def test_pushes_have_the_deviation_and_last_for_a_while():
    drawn = pushes(0, np.ones(8000))
    assert drawn.shape == (8000, 7)
    assert drawn.std(axis=0) == pytest.approx(np.full(7, DEVIATION), rel=0.15)
    assert abs(drawn.mean()) < DEVIATION / 10
    following = [np.corrcoef(column[1:], column[:-1])[0, 1] for column in drawn.T]
    assert all(0.75 < each < 0.95 for each in following)
    assert np.abs(np.corrcoef(drawn.T) - np.eye(7)).max() < 0.2  # each joint its own


@pytest.mark.parametrize("takes", [PERIOD, 1.0])  # [s]
def test_all_is_calm_while_the_gripper_moves(takes):
    time = PERIOD * (np.arange(8000) - CLOSES)
    drawn = pushes(0, np.clip(1 - time / takes, 0.0, 1.0))
    calm = (time > -CALM_BEFORE + 1e-9) & (time < takes - PERIOD + CALM_AFTER - 1e-9)
    assert np.all(drawn[calm] == 0)
    assert np.all(np.any(drawn[~calm & (np.abs(time) > 2)] != 0, axis=1))


def test_the_same_seed_pushes_the_same_and_no_deviation_does_not_push():
    assert np.array_equal(pushes(3, np.ones(50)), pushes(3, np.ones(50)))
    assert not np.array_equal(pushes(3, np.ones(50)), pushes(4, np.ones(50)))
    script = np.ones((50, 8))
    assert not np.any(disturbances(script, [7], 0.0, PERIOD, np.random.default_rng(0)))
