"""Actions that no policy should predict, given to commanders and to environments."""

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_il.arms.arm import Arm
from er_il.control.commander import ON_INVALID, Commander
from er_il.envs.decoders import Decoder
from er_il.envs.wrapper import make_action_space_env
from er_il.spaces.base import ArmSpace
from er_il.spaces.registry import make_arm_space
from er_il.support.errors import ErIlError

KINDS = ("joint", "task", "erj", "era", "delta_joint", "delta_task", "delta_erj", "delta_era")
# Eight joints have two redundant ones, of which an arm angle fixes only one.
COMMANDED = [("panda", kind) for kind in KINDS] + [("panda8", kind) for kind in KINDS if "era" not in kind]
PERIOD = 0.05  # [s]
EPISODE = 100  # actions between two resets
WILD = np.array([np.nan, np.inf, -np.inf, 1e308, -1e308, 1e30, 1e-320, 0.0, -0.0, 360.0])
TOLERANCE = 1e-9  # [rad] of the comparison with a limit


def wild_actions(space: ArmSpace, q: NDArray[np.float64], count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Actions (count, dim) around joint angles q (n,) [rad]: as of a policy, far off, and meaningless."""
    good = space.encode(np.tile(q, (count, 1)))
    kinds = rng.integers(5, size=count)[:, None]
    noise = rng.normal(size=good.shape)
    actions = np.select(
        [kinds == 0, kinds == 1, kinds == 2],
        [good + 0.02 * noise, good + noise, 10.0 ** rng.uniform(-3, 9, size=(count, 1)) * noise],
        good,
    )
    spoilt = (kinds == 3) & (rng.random(good.shape) < 0.3)  # some of the dimensions mean nothing
    return np.where(spoilt, rng.choice(WILD, size=good.shape), actions)


def fuzz_commanders(actions: int, seed: int) -> dict[str, Any]:
    """Give actions to commanders of several arms, spaces and answers to invalid actions.

    Returns:
        Number of actions, of commands that are not finite, outside the joint limits or faster than the velocity limit,
        of exceptions, and of each status.
    """
    rng = np.random.default_rng(seed)
    faults: Counter[str] = Counter(not_finite=0, outside_limits=0, too_fast=0, exceptions=0)
    statuses: Counter[str] = Counter()
    done = 0
    while done < actions:
        name, kind = COMMANDED[rng.integers(len(COMMANDED))]
        arm = Arm.preset(name)
        commander = Commander(make_arm_space(kind, arm), PERIOD, str(rng.choice(ON_INVALID)))
        q = rng.uniform(arm.lower, arm.upper)
        commander.reset(q)
        last = q
        count = min(EPISODE, actions - done)
        for action in wild_actions(commander.space, q, count, rng):
            # The arm follows, is held up, or moved by hand; now and then its encoders fail.
            near, far = last + rng.normal(scale=0.01, size=arm.dof), rng.uniform(-4, 4, arm.dof)
            measured = near if rng.random() < 0.9 else far
            if rng.random() < 0.01:
                measured[rng.integers(arm.dof)] = np.nan
            try:
                command = commander.command(action, measured)
            except Exception:
                faults["exceptions"] += 1
                continue
            statuses[str(command.status)] += 1
            faults["not_finite"] += not np.all(np.isfinite(command.q))
            faults["outside_limits"] += bool(np.any((command.q < arm.lower) | (command.q > arm.upper)))
            faults["too_fast"] += bool(np.any(np.abs(command.q - last) > arm.velocity * PERIOD + TOLERANCE))
            last = command.q
        done += count
    return {"actions": done, **faults, "statuses": dict(sorted(statuses.items()))}


def fuzz_environments(actions: int, seed: int) -> dict[str, Any]:
    """Step a task's environments with such actions, and with what is no action at all.

    Returns:
        Number of actions, of observations that are not finite, of steps outside the joint limits, of exceptions that
        are no refusals, of refused actions, and of refusals that changed the world.
    """
    rng = np.random.default_rng(seed)
    faults: Counter[str] = Counter(not_finite=0, outside_limits=0, exceptions=0, refused=0, changed_by_refusal=0)
    done = 0
    while done < actions:
        env = make_action_space_env("lift_cup", Decoder(str(rng.choice(KINDS))), on_invalid=str(rng.choice(ON_INVALID)))
        arm = env.world.arm
        env.reset(seed=int(rng.integers(2**31)))
        count = min(EPISODE, actions - done)
        for own in wild_actions(env.space, env.world.joint_positions, count, rng):
            with np.errstate(over="ignore"):
                action = np.append(own, rng.choice([0.0, 1.0, rng.normal(), rng.choice(WILD)])).astype(np.float32)
            if rng.random() < 0.02:  # no action of this space
                action = [None, action[:-1], np.tile(action, (2, 1)), "left"][rng.integers(4)]
            before = env.world.joint_positions.copy()
            try:
                observation, *_ = env.step(action)
            except (ValueError, ErIlError):
                faults["refused"] += 1
                faults["changed_by_refusal"] += not np.array_equal(before, env.world.joint_positions)
                continue
            except Exception:
                faults["exceptions"] += 1
                continue
            q = env.world.joint_positions
            faults["not_finite"] += not (np.all(np.isfinite(q)) and np.all(np.isfinite(observation["agent_pos"])))
            # A simulated joint is stopped by its limit as a spring would.
            faults["outside_limits"] += bool(np.any((q < arm.lower - 0.05) | (q > arm.upper + 0.05)))
        env.close()
        done += count
    return {"actions": done, **faults}
