"""An agent as LeRobot knows policies: its configuration (``type: er_il_agent``)."""

from dataclasses import dataclass, field

from lerobot.configs import FeatureType, NormalizationMode, PreTrainedConfig
from lerobot.utils.constants import ACTION, OBS_STATE

from er_il.rl.modes import AGENT
from er_il.support.errors import PolicyError


@PreTrainedConfig.register_subclass(AGENT)
@dataclass
class AgentConfig(PreTrainedConfig):
    """What an agent was trained for, and the size of its networks.

    Attributes:
        task: The task.
        mode: The action mode, see :mod:`er_il.rl.modes`.
        arm: The arm that does the task.
        layers: Widths of the hidden layers.
        state_names: Names of the state's dimensions.
        action_names: Names of the action's dimensions, those of the environment.
    """

    task: str = ""
    mode: str = ""
    arm: str = "panda"
    layers: list[int] = field(default_factory=list)
    state_names: list[str] = field(default_factory=list)
    action_names: list[str] = field(default_factory=list)
    normalization_mapping: dict[str, NormalizationMode] = field(
        default_factory=lambda: dict.fromkeys(("STATE", "VISUAL", "ACTION"), NormalizationMode.IDENTITY)
    )

    def validate_features(self) -> None:
        """Raise a PolicyError unless inputs and outputs are those of an agent."""
        inputs, outputs = self.input_features or {}, self.output_features or {}
        if OBS_STATE not in inputs or inputs[OBS_STATE].shape != (len(self.state_names),):
            raise PolicyError(f"An agent observes {OBS_STATE} of {len(self.state_names)} dimensions.")
        if set(outputs) != {ACTION} or outputs[ACTION].shape != (len(self.action_names),):
            raise PolicyError(f"An agent's output is {ACTION} of {len(self.action_names)} dimensions.")
        if any(each.type not in (FeatureType.STATE, FeatureType.VISUAL) for each in inputs.values()):
            raise PolicyError("An agent observes its state, and images.")

    @property
    def observation_delta_indices(self) -> None:
        return None

    @property
    def action_delta_indices(self) -> None:
        return None

    @property
    def reward_delta_indices(self) -> None:
        return None

    def get_optimizer_preset(self) -> None:  # pyrefly: ignore[bad-override]
        """None: agents learn in their environment, by ``er-il rl train``."""

    def get_scheduler_preset(self) -> None:
        """None, as :meth:`get_optimizer_preset`."""
