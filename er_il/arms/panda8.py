"""The paper's arm with eight joints: a Panda with two more joints at the base (paper V-D).

The new joints repeat the structure of the first two, a twist and a bend; the new twist is fixed.
So the arm bends at the new shoulder, then goes on as the Panda does from its first joint.
"""

import copy
import xml.etree.ElementTree as ET
from pathlib import Path

from er_il.arms.urdf import example_robot_data, generated_urdf, name_meshes_in, parse_urdf

PREFIX = "panda_base_"  # of the new links and joints
NEW = ("link1", "joint1", "link2", "joint2")
TORQUE = 3.0  # times the Panda's: the new bend carries about three times the inertia


def panda8_urdf() -> Path:
    """Path of the generated URDF, written on first use to the folder for temporary files."""
    panda = example_robot_data("panda_description/urdf/panda.urdf")
    return generated_urdf(_panda8_xml(parse_urdf(panda), panda.parents[4]), "panda8.urdf")


def _panda8_xml(panda: ET.Element, packages: Path) -> str:
    elements = {element.get("name", ""): element for element in panda}
    new = {name: copy.deepcopy(elements[f"panda_{name}"]) for name in NEW}
    for name, element in new.items():
        element.set("name", PREFIX + name)
    _connect(new["joint1"], "panda_link0", PREFIX + "link1")
    _connect(new["joint2"], PREFIX + "link1", PREFIX + "link2")
    new["joint1"].set("type", "fixed")
    limit = new["joint2"].find("limit")
    assert limit is not None
    limit.set("effort", str(TORQUE * float(limit.get("effort", 0.0))))
    # What the third joint is to the first two, the old first joint now is to the new ones.
    first = elements["panda_joint1"]
    _connect(first, PREFIX + "link2", "panda_link1")
    first.find("origin").attrib.update(elements["panda_joint3"].find("origin").attrib)  # pyrefly: ignore[missing-attribute]
    panda.set("name", "panda8")
    panda.extend(new.values())
    name_meshes_in(panda, packages)
    return ET.tostring(panda, encoding="unicode")


def _connect(joint: ET.Element, parent: str, child: str) -> None:
    for role, link in (("parent", parent), ("child", child)):
        end = joint.find(role)
        assert end is not None  # the Panda's joints have both
        end.set("link", link)
