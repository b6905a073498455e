"""The page on reinforcement learning: its script trains with another library and nothing else of er_il."""

import pytest
from documented import blocks

PAGE = "docs/reinforcement_learning.md"


@pytest.mark.slow
def test_stable_baselines_trains_by_the_pages_script(capsys: pytest.CaptureFixture[str]) -> None:
    script = next(block.text for block in blocks(PAGE) if block.marker and block.language == "python")
    assert "er_il" not in script.replace("er_il.envs.learning:er_il/ReachTarget-erj-v0", "")
    few = script.replace("STEPS = 40_000", "STEPS = 400").replace("n_eval_episodes=20", "n_eval_episodes=2")
    few = few.replace("learning_starts=1000", "learning_starts=100")
    assert few != script
    exec(compile(few, PAGE, "exec"), {})
    assert " of 2 starts succeed" in capsys.readouterr().out
