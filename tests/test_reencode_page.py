"""The commands of docs/reencode.md run as they stand, on a dataset of two arms."""

import re
import shlex
import sys
from pathlib import Path

import yaml
from foreign import ARMS, write_bimanual

from er_il.cli import main

PAGE = (Path(__file__).resolve().parents[1] / "docs/reencode.md").read_text()


def test_the_pages_commands_run(tmp_path, monkeypatch, capsys):
    arms = re.search(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
    assert arms is not None
    assert yaml.safe_load(arms[1]) == yaml.safe_load(ARMS)
    monkeypatch.chdir(tmp_path)
    Path("arms.yaml").write_text(arms[1])
    write_bimanual(Path("my_robot"))
    commands = re.findall(r"^    (er-il (?:[^\\\n]|\\\n)*)$", PAGE, re.MULTILINE)
    assert len(commands) == 6
    for command in commands:
        monkeypatch.setattr(sys, "argv", shlex.split(command.replace("\\\n", " ")))
        main()
    assert sorted(path.name for path in Path().glob("my_robot*")) == [
        "my_robot",
        "my_robot_again",
        "my_robot_era",
        "my_robot_erj",
        "my_robot_task",
    ]
    assert "my_robot_again: 17 dimensions" in capsys.readouterr().out
