"""A camera that looks at a simulated Franka arm, for LeRobot's ``zmq`` camera.

    python benchmarks/franka_camera.py fr3.xml states.csv --port 5555

``fr3.xml`` is the model and ``states.csv`` the log of ``franka_server.py``.
"""

import argparse
import base64
import json
import time
from pathlib import Path

import cv2
import mujoco
import numpy as np
import zmq
from numpy.typing import NDArray

PERIOD = 1 / 15  # [s]
TAIL = 1000  # [bytes] of the log that hold its last full line
VIEW = {"distance": 1.6, "azimuth": 140.0, "elevation": -22.0, "lookat": (0.25, 0.0, 0.45)}


class Scene:
    """Pictures of the arm at joint angles."""

    def __init__(self, model: Path, size: tuple[int, int]) -> None:
        """Load a model, to draw it in pictures of (width, height) pixels."""
        spec = mujoco.MjSpec.from_file(str(model))
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[2, 2, 0.1], rgba=[0.8, 0.82, 0.85, 1])
        spec.worldbody.add_light(pos=[1, -1, 3], dir=[-0.3, 0.3, -1])
        spec.visual.headlight.ambient = [0.45, 0.45, 0.45]
        # Cheap pictures: they share two cores with two arms' physics.
        spec.visual.quality.offsamples = 0
        spec.visual.global_.offwidth, spec.visual.global_.offheight = size
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._renderer = mujoco.Renderer(self._model, height=size[1], width=size[0])
        for effect in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._renderer.scene.flags[effect] = False
        self._camera = mujoco.MjvCamera()
        for name, value in VIEW.items():
            setattr(self._camera, name, value)

    def picture(self, q: NDArray[np.float64]) -> NDArray[np.uint8]:
        """The picture (height, width, 3) of the arm at q (7,) [rad]."""
        self._data.qpos[:7] = q
        mujoco.mj_forward(self._model, self._data)
        self._renderer.update_scene(self._data, self._camera)
        return self._renderer.render()


def last_angles(states: Path) -> NDArray[np.float64]:
    """The last joint angles (7,) [rad] of a log."""
    with states.open("rb") as file:
        file.seek(max(0, states.stat().st_size - TAIL))
        *_, line, _ = file.read().split(b"\n")  # the last may still be being written
    return np.array([float(value) for value in line.split(b",")[2:9]])


def main() -> None:
    """Publish pictures until killed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", type=Path)
    parser.add_argument("states", type=Path)
    parser.add_argument("--port", type=int, default=5555)
    parser.add_argument("--size", type=int, default=96, help="width and height [px]")
    options = parser.parse_args()
    scene = Scene(options.model, (options.size, options.size))
    socket = zmq.Context().socket(zmq.PUB)
    socket.bind(f"tcp://127.0.0.1:{options.port}")
    due = time.monotonic()
    while True:
        _, encoded = cv2.imencode(".jpg", scene.picture(last_angles(options.states)))
        socket.send_string(json.dumps({"images": {"front": base64.b64encode(encoded.tobytes()).decode()}}))
        due = max(due + PERIOD, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))


if __name__ == "__main__":
    main()
