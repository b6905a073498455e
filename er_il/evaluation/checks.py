"""What can be wrong with an evaluation, found without LeRobot, whose import takes seconds."""

from pathlib import Path

from er_il.arms.robot import robot_arms
from er_il.control.commander import check_answer
from er_il.envs.contract import check_policy, decoder_for, policy_contract
from er_il.envs.decoders import decoder
from er_il.envs.tasks import task_id
from er_il.support.errors import ErIlError


def check_evaluation(policy: Path, task: str, decoder_name: str, episodes: int, on_invalid: str, trust: bool) -> None:
    """Refuse what :func:`er_il.evaluation.rollouts.evaluate` cannot do; the arguments are its own.

    Raises:
        PolicyError: the policy is missing, was trained for another action space, or is not trusted.
        UnknownNameError: no such task, decoder, or answer to invalid actions.
        ErIlError: no episodes.
    """
    if episodes < 1:
        raise ErIlError(f"{episodes} episodes say nothing; ask for at least one.")
    task_id(task)
    check_answer(on_invalid)
    decoder(decoder_name)  # a mistake in the name is told first
    contract = policy_contract(policy)
    chosen = decoder_for(decoder_name, contract)
    check_policy(policy, chosen.layout_of(robot_arms(contract.arm), contract.rotation_code), trust)
