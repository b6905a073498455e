import sys

import pytest

from er_il.cli import USER_MISTAKE, main
from er_il.datasets.record import DatasetRecord


def _run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["er-il", *map(str, arguments)])
    main()


@pytest.mark.usefixtures("one_worker")
def test_generate_takes_the_recipe_and_what_is_given_instead(monkeypatch, tmp_path, capsys):
    out = tmp_path / "cups"
    _run(monkeypatch, "generate", "lift_cup", "--episodes", 2, "--seed", 4, "--spaces", "joint,erj", "--out", out)
    said = capsys.readouterr()
    assert "2 demonstrations" in said.out
    assert "Map" not in said.err  # LeRobot's own progress bars, one an episode
    assert sorted(path.name for path in out.iterdir()) == ["erj", "joint"]
    recipe = DatasetRecord.read(out / "erj").recipe
    assert (recipe.task, recipe.episodes, recipe.validation, recipe.seed) == ("lift_cup", 2, 1, 4)
    _run(monkeypatch, "generate", "lift_cup", "--episodes", 2, "--seed", 4, "--spaces", "joint", "--out", out)
    assert "was there already" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["sweep"], "Unknown task 'sweep'. Valid: bimanual_press, lift_cup, "),
        (["reach_cup", "--spaces", "polar"], "Unknown action space 'polar'. Valid: joint, task, erj"),
        (["reach_cup", "--cameras", "elbow"], "Unknown camera 'elbow'. Valid: "),
        (["reach_cup", "--episodes", "0"], "episodes is 0: Input should be greater than or equal to 1"),
        (
            ["reach_cup", "--size", "14", "--cameras", "wrist"],
            "image_size is 14: Input should be greater than or equal to 16",
        ),
        (["reach_cup", "--out", "/dev/null/here"], "Cannot write to /dev/null/here: Not a directory."),
    ],
)
def test_mistakes_are_one_line_and_exit_code_2(monkeypatch, tmp_path, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as exit_info:
        _run(monkeypatch, "generate", *arguments)
    assert exit_info.value.code == USER_MISTAKE
    error = capsys.readouterr().err
    assert message in error
    assert len(error.strip().splitlines()) == 1


def test_replay_without_data_says_how_to_get_it(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    for arguments in (["reach_cup"], []):
        with pytest.raises(SystemExit) as exit_info:
            _run(monkeypatch, "replay", *arguments)
        assert exit_info.value.code == USER_MISTAKE
    assert "er-il generate" in capsys.readouterr().err
