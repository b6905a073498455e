from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import er_il
from er_il.evaluation.trace import Trace
from er_il.support.errors import DatasetError, ShapeError


@pytest.fixture
def trace() -> Trace:
    space = er_il.make_action_space("erj", er_il.Arm.preset("panda"))
    rng = np.random.default_rng(0)
    return Trace(
        task="reach_cup",
        seed=7,
        period=0.05,
        label="erj",
        outcome="collision",
        spec=space.spec(),
        q=rng.normal(size=(3, 7)),
        gripper=rng.uniform(size=3),
        action=rng.normal(size=(3, 9)),
        command=rng.normal(size=(3, 7)),
        status=("ok", "limit", "not_converged"),
        environment_state=rng.normal(size=(3, 2)),
        environment_state_names=("cup.x", "cup.y"),
        images={"wrist": rng.integers(0, 256, (3, 4, 5, 3), dtype=np.uint8)},
    )


def test_a_saved_trace_comes_back_whole(trace: Trace, tmp_path: Path) -> None:
    path = tmp_path / "runs" / "trace.npz"
    trace.save(path)
    loaded = Trace.load(path)
    for name in trace.__dataclass_fields__:
        np.testing.assert_equal(getattr(loaded, name), getattr(trace, name))
    assert [f.name for f in path.parent.iterdir()] == ["trace.npz"]


def test_equal_traces_give_equal_files(trace: Trace, tmp_path: Path) -> None:
    for name in "ab":
        trace.save(tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.mark.parametrize("field", ["q", "gripper", "action", "command", "environment_state", "status"])
def test_rows_that_do_not_fit_are_refused(trace: Trace, field: str) -> None:
    with pytest.raises(ShapeError, match=r"Trace\."):
        replace(trace, **{field: getattr(trace, field)[:2]})


def test_a_file_that_is_no_trace_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.npz").write_text("hello")
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    for name in ("text.npz", "other.npz", "absent.npz"):
        with pytest.raises(DatasetError, match=name):
            Trace.load(tmp_path / name)
