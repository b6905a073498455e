"""Every command that the pages show is run: as it stands, or with smaller numbers behind it."""

import contextlib
import functools
import io
import re
import shlex
import shutil
import textwrap
from collections.abc import Callable
from pathlib import Path

import draccus
import pytest
from chains import write_chain
from documented import PAGES, ROOT, Block, blocks, entry_point, run, train_in_process
from foreign import write_bimanual, write_one_arm, write_openarm
from lerobot.policies.act.configuration_act import ACTConfig
from public_schemas import beside_poses, libero

import er_il.cli
from er_il import Arm

pytestmark = pytest.mark.usefixtures("quiet_logging", "one_worker")

# What is put behind a command, where it would take long or download something; the last of equal options counts.
SMALLER = {
    "er-il generate": "--episodes 3",
    "er-il train": "--steps 2",
    "er-il eval": "--episodes 1",
    "er-il rl train": "--steps 8 --no-film",
    "er-il rl eval": "--episodes 1 --films 0",
    "lerobot-train": "--steps=2 --batch_size=2 --num_workers=0 --policy.device=cpu --dataset.video_backend=pyav "
    "--policy.pretrained_backbone_weights=null --policy.dim_model=32 --policy.dim_feedforward=32 --policy.n_heads=2",
    "lerobot-eval": "--eval.n_episodes=1 --eval.batch_size=1 --eval.recording=true",
    "lerobot-record": "--dataset.num_episodes=2 --dataset.episode_time_s=0.5 --robot.image_size=32",
    "lerobot-teleoperate": "--teleop_time_s=0.3 --robot.image_size=32",
    "lerobot-replay --robot.type=er_il_arm": "--robot.inner.image_size=32",
    "lerobot-replay": "--robot.image_size=32",
    "lerobot-rollout --robot.type=er_il_arm": "--duration=0.3 --robot.inner.image_size=32",
    "lerobot-rollout": "--duration=0.3 --robot.image_size=32",
    "lerobot-dataset-viz": "--save=1 --output-dir=.",
}
CI = ".ci/run"
TEST = "test"  # marks the README's block that .ci/run runs
NEEDS = ("needs: hardware", "needs: a network", "needs: a display")  # read their arguments, and no more
SHOWN_ONLY = {"yaml", "text"}  # languages of blocks that hold no commands


def prepare_real_arm(folder: Path) -> None:
    fr3, xarm = Arm.preset("fr3"), Arm.preset("xarm7")
    write_one_arm(folder / "demos/franka", fr3, [f"{joint}.pos" for joint in fr3.joints], degrees=True)
    write_one_arm(folder / "demos/xarm", xarm, [f"joint{i}.pos" for i in range(1, 8)], degrees=True)
    write_openarm(folder)
    # lerobot-rollout reads the policy's configuration as one of its arguments.
    (folder / "policies/reach_erj_robot").mkdir(parents=True)
    ACTConfig(device="cpu").save_pretrained(folder / "policies/reach_erj_robot")


def prepare_reencoding(folder: Path) -> None:
    write_bimanual(folder / "my_robot")
    beside_poses(folder / "poses")
    libero(folder / "deltas")


def prepare_panda(folder: Path) -> None:
    panda = Arm.preset("panda")
    write_one_arm(folder / "my_robot", panda, [f"{joint}.pos" for joint in panda.joints], degrees=True)


# What a reader of the page has already.
PREPARED: dict[str, Callable[[Path], object]] = {
    "docs/arms.md": lambda folder: write_chain(folder / "my_arm.urdf", 7),
    "docs/real_arm.md": prepare_real_arm,
    "docs/reencode.md": prepare_reencoding,
    "docs/retarget.md": prepare_panda,
}


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder with the configurations, as after a clone, to work in."""
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run_here(page: str) -> list[Block]:
    """The blocks that nothing else runs; none if the README shows all that they say, in the same words."""
    here = [
        block
        for block in blocks(page)
        if block.language in {"bash", "python"} and (not block.marker or block.marker in NEEDS)
    ]
    shown = [command for block in blocks("README.md") for command in block.commands]
    repeated = all(block.language == "bash" and all(each in shown for each in block.commands) for block in here)
    return [] if repeated and page != "README.md" else here


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if run_here(page)])
def test_the_commands_run(page: str, workspace: Path, monkeypatch: pytest.MonkeyPatch):
    PREPARED.get(page, lambda folder: None)(workspace)
    monkeypatch.setattr("er_il.envs.learning.DECISIONS", 20)  # of 200
    train_in_process(monkeypatch, "--batch_size=2")
    names: dict[str, object] = {}
    for block in blocks(page):
        if block.language == "yaml":  # its first line says which file it is
            Path(block.text.split("\n")[0].removeprefix("# ")).write_text(block.text)
    for block in run_here(page):
        if block.marker:
            for command in block.commands:
                parse(command, monkeypatch)
        elif block.language == "python":
            exec(textwrap.dedent(block.text), names)
        else:
            for command in block.commands:
                smaller = next((SMALLER[start] for start in SMALLER if shlex.join(command).startswith(start)), "")
                run(*command, *shlex.split(smaller))


@pytest.mark.parametrize("page", PAGES)
def test_every_command_is_run_or_the_page_says_why_not(page: str, monkeypatch: pytest.MonkeyPatch):
    for block in blocks(page):
        assert block.language in {"bash", "python", *SHOWN_ONLY}, block.text
        if block.marker == TEST:
            assert page == "README.md"  # where .ci/run looks for it
        elif block.marker and block.marker not in NEEDS:
            assert block.marker.startswith("run by: "), block.marker
            for command in block.commands:
                assert is_run_by(block.marker.removeprefix("run by: "), command, page), shlex.join(command)
    assert not re.findall(r"^ {4}(?:er-il|lerobot-|uv|pip) .*$", prose(page), re.MULTILINE)
    for span in re.findall(r"`((?:er-il|lerobot-)[^`]*)`", prose(page)):
        name, *words = span.split()
        options = {word.split("=")[0] for word in words if word.startswith("--")}
        if name == "er-il" and words and words[0] != "COMMAND":
            assert options <= options_of(*subcommand(words)) | {"--help"}, span
        else:
            assert entry_point(name), span
            assert name == "er-il" or not options, f"{span}: show it in a block, where it is run"


@pytest.mark.parametrize("page", PAGES)
def test_options_that_a_page_names_exist(page: str):
    """In each command that is shown, run here or elsewhere, and by themselves in the text.

    LeRobot's options have a dot; its own commands read them where they are run.
    """
    others: set[str] = set()  # options of other programs that the page's commands use
    for block in blocks(page):
        for program, *words in block.commands:
            given = {word.split("=")[0] for word in words if re.match(r"--[a-z]", word)}
            if program == "er-il" and words and not words[0].startswith("-"):
                assert given <= options_of(*subcommand(words)) | {"--help"}, shlex.join(words)
            else:
                others |= given
    every = [name for name in er_il.cli.COMMANDS if name not in GROUPS] + [
        f"{group} {name}" for group, names in GROUPS.items() for name in names
    ]
    ours = set().union(*(options_of(*name.split()) for name in every))
    spans = [span for span in re.findall(r"`([^`\n]+)`", prose(page)) if span.startswith("--")]
    for span in spans:
        for option in re.findall(r"(?<![\w-])--[a-z][\w-]*(?![\w.-])", span):
            assert option in ours | others, f"{page}: {span}"


@pytest.mark.parametrize("page", PAGES)
def test_links_and_pictures_lead_somewhere(page: str):
    for target in re.findall(r"\]\((?!https?://)([^)#]+)", prose(page)):
        assert (ROOT / page).parent.joinpath(target).exists(), target


def prose(page: str) -> str:
    """A page without its fenced blocks."""
    return re.sub(r"^```.*?^```$", "", (ROOT / page).read_text(), flags=re.MULTILINE | re.DOTALL)


def is_run_by(file: str, command: list[str], page: str) -> bool:
    source = (ROOT / file).read_text()
    by_ci = [each for block in blocks("README.md") if block.marker == TEST for each in block.commands]
    if command in by_ci or (file == CI and shlex.join(command) in source):
        return True
    taken = re.findall(r'documented\("([^"]+)", "([^"]+)"', source)
    return any(where == page and shlex.join(command).startswith(start) for where, start in taken)


# Commands that have commands of their own.
GROUPS = {"rl": ("train", "eval"), "study": ("validity", "joints", "deltas", "margins", "elbow_angle")}


def subcommand(words: list[str]) -> list[str]:
    """The command in what is behind er-il."""
    return words[: 2 if words[0] in GROUPS else 1]


@functools.lru_cache
def options_of(*command: str) -> set[str]:
    """The options of one of er-il's commands, by its help."""
    shown = io.StringIO()
    with contextlib.redirect_stdout(shown):
        run("er-il", *command, "--help")
    return set(re.findall(r"--[a-z][a-z-]*", shown.getvalue()))


class ParsedError(Exception):
    """The arguments were understood."""


def parse(command: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a command read its arguments, and no more."""

    def stop(function: Callable[..., object]) -> Callable[..., object]:
        @functools.wraps(function)
        def stopped(*args: object, **kwargs: object) -> None:
            raise ParsedError

        return stopped

    def parsed(*args: object, **kwargs: object) -> None:
        draccus_parse(*args, **kwargs)
        raise ParsedError

    draccus_parse, find = draccus.parse, er_il.cli._command
    with monkeypatch.context() as patch, pytest.raises(ParsedError):
        patch.setattr(er_il.cli, "_command", lambda name, module: stop(find(name, module)))
        patch.setattr(draccus, "parse", parsed)
        run(*command)
