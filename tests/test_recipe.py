import inspect
import json

import gymnasium
import numpy as np
import pytest

from er_il.datasets.recipe import DEMO_SEED_BASE, Recipe, recipe_names
from er_il.envs.tasks import task_id, task_names
from er_il.support.errors import DatasetError, UnknownNameError
from sim_tasks.tasks.registration import leader_class

VALID = {"task": "reach_cup", "episodes": 40, "validation": 8}
RECIPE = Recipe.from_dict(VALID)
FIRST_EVALUATION_SEED = 1000  # LeRobot's


def test_shipped_recipes_are_the_paper_s_split_and_fit_a_task():
    assert set(recipe_names()) == set(task_names())
    for name in recipe_names():
        recipe = Recipe.load(name)
        assert recipe.task == name
        assert name in task_names()
        assert (recipe.episodes, recipe.validation) == (40, 8)
        assert recipe.splits == {"train": "0:32", "validation": "32:40"}


def test_round_trip_through_json():
    ranges = {"cup_range": [0.01, 0.02]}
    recipe = RECIPE.replaced(episodes=5, validation=1, seed=3, cameras=("wrist",), image_size=32, randomisation=ranges)
    assert Recipe.from_dict(json.loads(json.dumps(recipe.to_dict()))) == recipe


@pytest.mark.parametrize(("episodes", "validation"), [(40, 8), (10, 2), (12, 3), (2, 1), (1, 0)])
def test_resized_keeps_the_share_and_something_to_train_on(episodes, validation):
    assert RECIPE.resized(episodes).validation == validation


def test_demo_seeds_never_meet_evaluation_seeds_nor_another_recipe_seed():
    demos = [set(_first(RECIPE.replaced(seed=seed).demo_seeds(), 200)) for seed in (0, 1, 2)]
    assert not demos[0] & demos[1] | demos[1] & demos[2] | demos[0] & demos[2]
    assert min(min(seeds) for seeds in demos) >= DEMO_SEED_BASE > FIRST_EVALUATION_SEED + 10_000


def test_differences_name_key_and_both_values():
    one, other = RECIPE, RECIPE.replaced(seed=7, cameras=("wrist",))
    assert one.differences(one) == ""
    assert one.differences(other) == "seed 0 instead of 7, cameras [] instead of ['wrist']"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ("reach_cup", "mapping"),
        ({"task": "reach_cup", "episodes": 40}, "lacks validation"),
        (VALID | {"camera": []}, "no camera. Valid: task"),
        ({"task": "reach_cup", "episodes": "many", "validation": 8}, "episodes is 'many': .*valid integer"),
        ({"task": "reach_cup", "episodes": True, "validation": 0}, "episodes is True: .*valid integer"),
        (VALID | {"cameras": "wrist"}, "cameras is 'wrist': .*valid tuple"),
        (VALID | {"randomisation": [1]}, r"randomisation is \[1\]: .*valid dictionary"),
        ({"task": "reach_cup", "episodes": 0, "validation": 0}, "episodes is 0: .*greater than or equal to 1"),
        ({"task": "reach_cup", "episodes": 8, "validation": 8}, "at least one must be left"),
        (VALID | {"seed": -1}, "seed is -1: .*greater than or equal to 0"),
        (VALID | {"image_size": 97}, "image_size is 97: .*multiple of 2"),
        (VALID | {"image_size": 8}, "greater than or equal to 16"),
        (VALID | {"disturbance": 0.1}, "disturbance is 0.1: .*less than 0.1"),
        (VALID | {"cameras": ["wrist", "wrist"]}, "twice"),
        ({"episodes": 0, "task": 3, "view": 1}, "no view. Valid: .* lacks validation. task is 3: .* episodes is 0: "),
    ],
)
def test_wrong_recipes_are_refused_by_name(values, message):
    with pytest.raises(DatasetError, match=message) as error_info:
        Recipe.from_dict(values)
    assert len(str(error_info.value).splitlines()) == 1


def test_replaced_values_are_checked_too():
    with pytest.raises(DatasetError, match=r"no camera\. Valid: task"):
        RECIPE.replaced(camera=())
    with pytest.raises(DatasetError, match="episodes is 0"):
        RECIPE.resized(0)


def test_files_that_are_no_recipe(tmp_path):
    path = tmp_path / "broken.yaml"
    path.write_text("task: [reach_cup")
    with pytest.raises(DatasetError, match=r"broken\.yaml is not valid YAML"):
        Recipe.from_file(path)
    with pytest.raises(DatasetError, match=r"no recipe .*missing\.yaml"):
        Recipe.from_file(tmp_path / "missing.yaml")
    with pytest.raises(UnknownNameError, match=r"'sweep'\. Valid: .*lift_cup.*reach_cup"):
        Recipe.load("sweep")


WIDER = ("start_range", "sway_range")


@pytest.mark.parametrize("name", recipe_names())
def test_a_recipe_declares_the_randomisation_that_evaluation_has(name):
    """Evaluation makes its environments without a recipe: the defaults must be what was recorded.

    Only the arm may have started from farther apart than it does in evaluation, and the leader's hand have swayed.
    """
    task = type(gymnasium.make(task_id(name)).unwrapped)
    defaults = {
        key: parameter.default
        for base in reversed([*task.__mro__, *leader_class(task.task).__mro__])  # a class overrides its bases
        if "__init__" in vars(base)
        for key, parameter in inspect.signature(base.__init__).parameters.items()
    }
    for key, value in Recipe.load(name).randomisation.items():
        assert np.allclose(value, defaults[key]) or (key in WIDER and value > defaults[key]), key
    assert {key for key in defaults if key.endswith("_range")} == set(Recipe.load(name).randomisation)


def _first(seeds, number):
    return [next(seeds) for _ in range(number)]
