"""Take Lid Off Saucepan: grasp the lid by its knob and bring it to a mark above the pan (paper V-A)."""

from typing import Any

import mujoco
import numpy as np

from sim_tasks.tasks.carry_task import MARK, CarryTask
from sim_tasks.tasks.placement import Placement, yawed
from sim_tasks.world.randomisation import sides, span
from sim_tasks.world.saucepan import KNOB_MIDDLE, Saucepan

LID, SAUCEPAN = "lid", "saucepan"
LIFT = 0.15  # [m] from the knob up to the mark


class TakeLidOffSaucepan(CarryTask):
    """The lid held above the pan."""

    task = "take_lid_off_saucepan"
    task_description = "Take the lid off the saucepan."
    objects = (LID, SAUCEPAN, MARK)
    graspable = (LID,)
    target = LID
    grasp_offset = (0.0, 0.0, KNOB_MIDDLE)
    arms = ("panda", "panda8")
    pan = Saucepan()
    centre = (0.475, 0.0)  # x, y [m] of the middle of the pan's places
    handle_yaw = -np.pi / 2  # [rad] the handle's mean direction: to the right

    def __init__(
        self, *, pan_range: tuple[float, float] = (0.20, 0.40), pan_yaw_range: float = 1.2, **kwargs: Any
    ) -> None:
        """Build the task.

        Args:
            pan_range: Sides [m] of the rectangle in which the pan stands.
            pan_yaw_range: Its handle is turned up to this far [rad] to either side.
            kwargs: See :class:`ObjectTask`.
        """
        self._pan_range = sides("pan_range", pan_range)
        self._pan_yaw_range = span("pan_yaw_range", pan_yaw_range)
        super().__init__(**kwargs)

    def _build(self, spec: mujoco.MjSpec) -> None:
        super()._build(spec)
        self.pan.add(spec, SAUCEPAN)
        self.pan.lid.add(spec, LID, (0.0, 0.0, self.pan.height))

    def _draw(self, rng: np.random.Generator) -> Placement:
        x, y = np.array(self.centre) + (rng.random(2) - 0.5) * self._pan_range
        return {SAUCEPAN: (x, y, self.handle_yaw + rng.uniform(-self._pan_yaw_range, self._pan_yaw_range))}

    def _arrange(self, placement: Placement) -> None:
        pan = placement[SAUCEPAN]
        x, y, yaw = pan
        self._put(SAUCEPAN, (x, y, 0.0), yawed(yaw))
        x, y, yaw = placement.get(LID, pan)  # placed by hand beside the pan, it falls on the bench
        self._put(LID, (x, y, self.pan.height), yawed(yaw))
        x, y, _ = placement.get(MARK, pan)
        self._put(MARK, (x, y, self.pan.height + KNOB_MIDDLE + LIFT))
