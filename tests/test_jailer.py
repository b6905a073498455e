"""JAiLeR: the controller's goals, errors and rewards by values, and what becomes of its transitions."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from acting import SMALL
from scipy.spatial.transform import Rotation
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import DummyVecEnv

from er_il.envs import make_rl_env
from er_il.rl.controller import ControllerView
from er_il.rl.jailer import Jailer
from er_il.rl.loading import load_agent
from er_il.rl.training import AgentTraining

HAND = ("ee.x", "ee.y", "ee.z", "ee.xx", "ee.xy", "ee.xz", "ee.yx", "ee.yy", "ee.yz")
NAMES = ("a.pos", "b.pos", "a.vel", "b.vel", "gripper", *HAND, "a.left", "b.left", "ball.dx")
VIEW = ControllerView(NAMES)


def state(position: Any = (0, 0, 0), turn: Any = (0, 0, 0), velocity: Any = (0, 0), left: Any = (0, 0)) -> np.ndarray:
    axes = Rotation.from_rotvec(turn).as_matrix().T[:2].ravel()
    return np.array([[0.1, 0.2, *velocity, 1.0, *position, *axes, *left, 9.0]], dtype=np.float32)


def test_the_controller_sees_the_arm_and_what_is_asked_for() -> None:
    seen = VIEW.observe(state(velocity=(3, 4), left=(5, 6)), np.array([[0.5, 0, 0, 0, 0, -1, 1]]))
    assert seen[0] == pytest.approx([0.1, 0.2, 3, 4, 5, 6, 0.5, 0, 0, 0, 0, -1])
    assert len(VIEW.inputs) == 12


def test_a_goal_is_a_change_of_the_measured_pose() -> None:
    turned = (0.0, 0.0, np.pi / 2)
    positions, turns = VIEW.goals(state((0.4, 0.1, 0.3), turned), np.array([[1, 0, -0.5, 1, 0, 0, 1]]))
    assert positions[0] == pytest.approx([0.45, 0.1, 0.275])
    expected = Rotation.from_rotvec([0.05, 0, 0]) * Rotation.from_rotvec(turned)  # about the base frame's axes
    assert (turns * expected.inv()).magnitude() == pytest.approx([0], abs=1e-6)


def test_rewards_are_the_papers() -> None:
    before, goals = state(), VIEW.goals(state(), np.array([[1, 0, 0, 0, 0, 1, 1]]))
    reached = state((0.05, 0, 0), (0, 0, 0.05))
    assert VIEW.rewards(before, reached, goals) == pytest.approx([1.0])
    # Nothing done: exp(-20 (0.05² + 0.05²)).
    assert VIEW.rewards(before, before, goals) == pytest.approx([np.exp(-20 * 0.005)])
    # 0.3 and 0.4 rad/s within 0.1 s: an acceleration of 5 rad/s².
    assert VIEW.rewards(before, state((0.05, 0, 0), (0, 0, 0.05), (0.3, 0.4)), goals) == pytest.approx([1 - 0.005 * 5])
    errors = VIEW.errors(before, goals)
    assert errors[0] == pytest.approx([0.05, 0, 0, 0, 0, 0.05], abs=1e-6)
    assert VIEW.shares(errors)[0] == pytest.approx([1, 0, 0, 0, 0, 1], abs=1e-5)


class Counting(gymnasium.Env[Any, Any]):
    """Ends every third step; the first joint's velocity counts the steps, and the task's reward is 0.5."""

    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (len(NAMES),), np.float32)
    action_space = gymnasium.spaces.Box(-1, 1, (3,), np.float32)

    def reset(self, **_: Any) -> Any:
        self.steps = 0
        return state()[0], {}

    def step(self, action: np.ndarray) -> Any:
        self.steps += 1
        self.action = action
        return state(velocity=(self.steps, 0))[0], 0.5, False, self.steps == 3, {}


@pytest.mark.parametrize("rewarded", [False, True])
def test_the_controllers_transitions(rewarded: bool, tmp_path: Path) -> None:
    settings = SMALL.replaced(environments=1, reward_scale=2.0)
    envs = Jailer(DummyVecEnv([Counting]), NAMES, settings, 0, rewarded)
    envs.controller.set_logger(configure(str(tmp_path), []))
    assert envs.action_space.shape == (7,)
    envs.reset()
    asked = [np.array([[0.1 * step, 0, 0, 0, 0, 0, 1]], dtype=np.float32) for step in range(5)]
    for action in asked:
        envs.step(action)
    buffer = envs.controller.replay_buffer
    assert buffer is not None
    assert buffer.pos == 4  # the last one waits for the goal that comes after it
    assert buffer.observations[:4, 0, 6] == pytest.approx([0, 0.1, 0.2, 0.3])
    assert buffer.observations[:4, 0, 2].tolist() == [0, 1, 2, 0]  # a new episode began
    assert buffer.next_observations[:4, 0, 2].tolist() == [1, 2, 3, 1]
    # The goal that follows is the next one said; at the end, what was left: the hand has not moved.
    assert buffer.next_observations[:4, 0, 6] == pytest.approx([0.1, 0.2, 0.2, 0.4])
    assert buffer.dones[:4, 0].tolist() == buffer.timeouts[:4, 0].tolist() == [0, 0, 1, 0]
    error = np.exp(-20 * (0.05 * 0.1 * np.arange(4)) ** 2)
    task = 0.05 * 0.5 if rewarded else 0.0
    assert buffer.rewards[:4, 0] == pytest.approx(2.0 * (error - 0.005 * 10 + task))


@pytest.mark.slow
def test_both_learn_at_once_and_act_together(tmp_path: Path) -> None:
    training = AgentTraining("reach_target", "jailer", 128, 0, SMALL, tmp_path / "agent")
    assert [each.steps for each in training.run()] == [64, 128]
    agent = load_agent(training.out)
    assert agent.controller is not None
    env = make_rl_env("reach_target", "joint")
    observation, _ = env.reset(seed=0)
    action = agent.act(observation)
    assert env.action_space.contains(action)
    last = agent.actor(observation_tensor(observation), deterministic=True).detach().numpy()
    seen = ControllerView(env.observation_names).observe(observation[None], last)
    joints = agent.controller(observation_tensor(seen[0]), deterministic=True).detach().numpy()
    assert action == pytest.approx(np.append(joints, last[0, -1]), abs=1e-6)
    again = AgentTraining("reach_target", "jailer", 130, 0, SMALL, tmp_path / "agent")
    assert [each.steps for each in again.run()] == [64, 128, 130]
    env.close()


def observation_tensor(observation: np.ndarray) -> Any:
    import torch

    return torch.from_numpy(observation)[None]
