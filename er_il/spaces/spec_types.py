"""Types of the values in an action specification, which travels in files; what is missing is told elsewhere."""

import math
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, Field, StrictFloat, StrictInt, StrictStr

from er_il.support.declaration import check_values
from er_il.support.errors import SpecError

Number = Annotated[StrictInt | StrictFloat, Field(allow_inf_nan=False)]
Names = list[StrictStr]
Numbers = list[Number]


def _unit(values: Numbers) -> Numbers:
    if not math.isclose(math.hypot(*values), 1.0, abs_tol=1e-3):
        raise ValueError("it is no unit quaternion")
    return values


class _Arm(BaseModel):
    name: StrictStr = ""
    urdf: StrictStr = ""
    joints: Names = []
    base_frame: StrictStr = ""
    ee_frame: StrictStr = ""
    redundant: Names = []
    fingerprint: StrictStr = ""
    xml: StrictStr = ""
    home: Numbers = []
    angle_frames: Mapping[StrictStr, StrictStr] | None = None


class _Motors(BaseModel):
    joints: Names = []
    units: StrictStr = ""
    signs: Numbers = []
    offsets: Numbers = []
    state: Names = []


class _Angle(BaseModel):
    reference: Number = 0.0


class _LinearCoordinates(BaseModel):
    joints: Names = []
    weights: list[Numbers] = []


class _Space(BaseModel):
    label: StrictStr = ""
    space: StrictStr = ""
    arm: _Arm = _Arm()
    motors: _Motors = _Motors()
    names: Names = []
    rotation: StrictStr = ""
    hemisphere: Annotated[Numbers, Field(min_length=4, max_length=4), AfterValidator(_unit)] = [0, 0, 0, 1]
    arm_angle: _Angle = _Angle()
    linear_coordinates: _LinearCoordinates = _LinearCoordinates()
    bounds: dict[StrictStr, Annotated[Number, Field(gt=0)]] = {}


class _Spec(_Space):
    """Of one arm, or of a layout with several."""

    joint_names: Names = []
    chunk: Annotated[StrictInt, Field(ge=1)] = 1
    arms: Annotated[list[_Space], Field(min_length=1)] = [_Space()]


def check_types(spec: Mapping[str, Any]) -> None:
    """Check that each value of a specification is of the type that it must have.

    Raises:
        SpecError: one is not; names it.
    """
    check_values(_Spec, spec, "The action spec", SpecError)
