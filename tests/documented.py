"""The commands that the pages show, as tests run them."""

import re
import shlex
import sys
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

import pytest

from er_il.policy.training import Training

ROOT = Path(__file__).resolve().parents[1]
PAGES = (
    "README.md",
    "CONTRIBUTING.md",
    "datasets/README.md",
    "policies/README.md",
    *sorted(str(page.relative_to(ROOT)) for page in (ROOT / "docs").glob("*.md")),
)

_BLOCK = re.compile(r"^(?:<!-- (?P<marker>[^>]*) -->\n)? *```(?P<language>\w+)\n(?P<text>.*?)^ *```$", re.M | re.S)
_RUNNER = ("uv", "run")
_WITH_VALUE = {"--group"}  # of its options


@dataclass(frozen=True)
class Block:
    """A fenced block of a page.

    A comment in the line above says what becomes of it: ``needs: ...`` names what a test machine has
    not, ``run by: FILE`` who runs it if not :mod:`test_docs`. Without one, ``test_docs`` runs it.
    """

    page: str
    language: str
    text: str
    marker: str

    @property
    def commands(self) -> list[list[str]]:
        """The commands, in the words that a shell would pass on, without ``uv run`` before them."""
        commands: list[list[str]] = []
        if self.language != "bash":
            return commands
        for line in self.text.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            while words:
                end = words.index("&&") if "&&" in words else len(words)
                command, words = words[:end], words[end + 1 :]
                if tuple(command[:2]) == _RUNNER:
                    command = command[2:]
                    while command[0].startswith("-"):
                        command = command[2 if command[0] in _WITH_VALUE else 1 :]
                commands.append(command)
        return commands


@lru_cache
def blocks(page: str) -> tuple[Block, ...]:
    """The fenced blocks of a page that name a language."""
    text = (ROOT / page).read_text()
    return tuple(
        Block(page, match["language"], match["text"], match["marker"] or "") for match in _BLOCK.finditer(text)
    )


def documented(page: str, start: str) -> list[str]:
    """The first command of a page that starts with these words, without the program's name."""
    words = start.split()
    for block in blocks(page):
        for command in block.commands:
            if command[: len(words)] == words:
                return command[1:]
    raise AssertionError(f"{page} shows no command that starts with {start!r}.")


def entry_point(program: str) -> EntryPoint:
    """The function behind the name of one of our programs or LeRobot's.

    Raises:
        AssertionError: it is neither, or not installed.
    """
    assert program == "er-il" or program.startswith("lerobot-"), f"{program} is not run by tests."
    found = list(entry_points(group="console_scripts", name=program))
    assert found, f"No package installs {program}."
    return found[0]


def run(program: str, *arguments: str) -> None:
    """Run a program in this process: LeRobot's take ten seconds to import."""
    main = entry_point(program).load()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", [program, *arguments])
        try:
            main()
        except SystemExit as left:
            assert not left.code, f"{shlex.join([program, *arguments])} exits with {left.code}"


def train_in_process(monkeypatch: pytest.MonkeyPatch, *options: str) -> None:
    """Let ``er-il train`` run its stock command in this process, with more options."""

    def train(training: Training, output: object = None) -> int:
        training.prepare()
        run(*training.command, *options)
        return 0

    monkeypatch.setattr(Training, "run", train)
