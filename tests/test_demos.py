import numpy as np
import pytest

from er_il.datasets.demos import Demo, collect, make_world, record_demo
from er_il.datasets.recipe import Recipe
from er_il.support.errors import DatasetError, UnknownNameError

RECIPE = Recipe.load("lift_cup")


@pytest.fixture(scope="module")
def world():
    world = make_world(RECIPE)
    yield world
    world.close()


def test_a_seed_gives_the_same_demo_whatever_was_recorded_before(world):
    seeds = RECIPE.demo_seeds()
    first, second = next(seeds), next(seeds)
    demo = record_demo(world, first)
    other = record_demo(world, second)
    again = record_demo(world, first)
    assert isinstance(demo, Demo)
    assert isinstance(other, Demo)
    assert isinstance(again, Demo)
    for name in ("joints", "state", "environment_state"):
        assert getattr(demo, name).tobytes() == getattr(again, name).tobytes()
    assert not np.array_equal(demo.environment_state[0], other.environment_state[0])
    assert len(demo.joints) == len(demo.state) == len(demo.environment_state)


def test_a_row_holds_what_was_seen_before_the_action(world):
    seed = next(RECIPE.demo_seeds())
    demo = record_demo(world, seed)
    assert isinstance(demo, Demo)
    observation, _ = world.reset(seed=seed)
    np.testing.assert_array_equal(demo.state[0], observation["agent_pos"])
    observation, *_ = world.step(demo.joints[0])
    np.testing.assert_array_equal(demo.state[1], observation["agent_pos"])


def test_a_disturbed_follower_leaves_the_way_that_the_recorded_action_leads_back_to(world):
    seed = next(RECIPE.demo_seeds())
    calm, pushed = record_demo(world, seed), record_demo(world, seed, disturbance=0.006)
    assert isinstance(calm, Demo)
    assert isinstance(pushed, Demo)
    np.testing.assert_array_equal(pushed.joints, calm.joints)
    away = np.abs(pushed.state[:, :7] - calm.state[:, :7])
    assert 0.002 < away.mean() < 0.01
    assert away[-1].max() < 0.004  # calm again at the grasp


def test_saved_demos_come_back(tmp_path):
    rng = np.random.default_rng(0)
    joints, state, poses = (rng.normal(size=(5, k)).astype(np.float32) for k in (8, 15, 7))
    demo = Demo(3, joints, state, poses, {"wrist": rng.integers(0, 255, (5, 4, 4, 3), dtype=np.uint8)})
    demo.save(tmp_path / "3.npz")
    back = Demo.load(tmp_path / "3.npz")
    assert back.seed == 3
    for name in ("joints", "state", "environment_state"):
        np.testing.assert_array_equal(getattr(back, name), getattr(demo, name))
    np.testing.assert_array_equal(back.images["wrist"], demo.images["wrist"])
    assert [path.name for path in tmp_path.iterdir()] == ["3.npz"]


def test_demos_that_cannot_succeed_end_with_their_reasons(tmp_path):
    unreachable = RECIPE.replaced(randomisation={**RECIPE.randomisation, "via_range": 5.0})
    with pytest.raises(DatasetError, match=r"10 of the first 10 demos failed \(no plan 10\).*randomisation"):
        list(collect(unreachable, tmp_path, workers=1))


def test_a_recipe_that_the_environment_refuses():
    with pytest.raises(DatasetError, match="colour"):
        make_world(RECIPE.replaced(randomisation={"colour": "red"}))
    with pytest.raises(UnknownNameError, match="camera 'elbow'"):
        make_world(RECIPE.replaced(cameras=("elbow",)))
    with pytest.raises(UnknownNameError, match="task 'sweep'"):
        make_world(RECIPE.replaced(task="sweep"))
