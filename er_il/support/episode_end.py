"""What an environment answers once its episode has ended."""

from typing import Any

Step = tuple[Any, float, bool, bool, dict[str, Any]]  # observation, reward, terminated, truncated, info


def after_the_end(last: Step, observation: Any) -> Step:
    """An observation with the verdict of the last step, without reward: an episode that has ended stays as it ended."""
    _, _, terminated, truncated, info = last
    terms = {"reward_terms": dict.fromkeys(info["reward_terms"], 0.0)} if "reward_terms" in info else {}
    return observation, 0.0, terminated, truncated, info | terms
