"""Cameras: mounting poses, fast rendering for policies and high-quality rendering for people."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from er_il.support.errors import ErIlError, RenderError, UnknownNameError

LARGEST_PICTURE = 1024  # [px]
PICTURE = (480, 640)  # [px] height and width of pictures for people
SHADOW = 2048  # [px] side of the shadow map of such a picture: that of a smaller one is as much smaller
UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class View:
    """A camera fixed to a body; points and directions in that body's frame [m]."""

    name: str
    body: str
    position: tuple[float, float, float]
    target: tuple[float, float, float]
    fovy: float  # [deg]
    up: tuple[float, float, float] = UP

    def add(self, spec: mujoco.MjSpec, shoulder_offset: float) -> None:
        """Add the camera to a spec; one that stands in the world stands ``shoulder_offset`` [m] higher."""
        back = np.subtract(self.position, self.target)  # a MuJoCo camera looks along its own -z
        right = np.cross(self.up, back)
        axes = np.column_stack([right, np.cross(back, right), back])
        x, y, z, w = Rotation.from_matrix(axes / np.linalg.norm(axes, axis=0)).as_quat()
        position = np.add(self.position, (0.0, 0.0, shoulder_offset if self.body == "world" else 0.0))
        spec.body(self.body).add_camera(name=self.name, pos=position, quat=(w, x, y, z), fovy=self.fovy)


SHOWCASE = "showcase"
VIEWS = (
    # On the hand, where the Panda carries its camera; both fingertips in view.
    View("wrist", "panda_hand", (0.075, 0.0, 0.02), (0.0, 0.0, 0.15), 70, up=(1.0, 0.0, 0.0)),
    # On the hand's other side, under it where it points forward.
    View("wrist2", "panda_hand", (-0.075, 0.0, 0.02), (0.0, 0.0, 0.15), 70, up=(1.0, 0.0, 0.0)),
    # Over the robot's left shoulder into the workspace.
    View("shoulder", "world", (-0.10, 0.50, 1.20), (0.60, 0.0, 0.55), 58),
    # Opposite the robot, as RLBench's front camera.
    View("front", "world", (1.45, 0.0, 0.95), (0.35, 0.0, 0.25), 55),
    # For people: the whole scene from the right.
    View(SHOWCASE, "world", (-0.12, -1.55, 1.05), (0.30, 0.0, 0.47), 44),
)


class Cameras:
    """Renders a model's cameras; contexts are made on first use, so that states alone need no GL."""

    def __init__(
        self, model: mujoco.MjModel, names: Sequence[str], size: int, picture: tuple[int, int] = PICTURE
    ) -> None:
        """Prepare images of ``names``, squares of ``size`` [px], and pictures for people, height by width [px]."""
        known = [model.camera(i).name for i in range(model.ncam)]
        for name in names:
            if name not in known:
                raise UnknownNameError("camera", name, known)
        for side in (size, *picture) if names else picture:
            if not 1 <= side <= LARGEST_PICTURE:
                raise ErIlError(f"Image size {side} is not between 1 and {LARGEST_PICTURE} px.")
        self.names = tuple(names)
        self._model = model
        self.size = size
        self._picture = picture
        self._policy: mujoco.Renderer | None = None
        self._people: mujoco.Renderer | None = None

    def images(self, data: mujoco.MjData) -> dict[str, np.ndarray]:
        """Images (size, size, 3) uint8 for a policy: no shadows, which cost ten times the picture."""
        if self._policy is None:
            self._policy = _renderer(self._model, self.size, self.size, samples=0)
        images = {}
        for name in self.names:
            self._policy.update_scene(data, camera=name)
            for effect in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
                self._policy.scene.flags[effect] = 0
            images[name] = self._policy.render()
        return images

    def picture(self, data: mujoco.MjData, camera: str = SHOWCASE) -> np.ndarray:
        """A picture (H, W, 3) uint8 for people, with shadows and smooth edges."""
        if self._people is None:
            self._people = _renderer(self._model, *self._picture, samples=4)
        self._people.update_scene(data, camera=camera)
        return self._people.render()

    def close(self) -> None:
        """Free the GL contexts."""
        for renderer in (self._policy, self._people):
            if renderer is not None:
                renderer.close()
        self._policy = self._people = None


def _renderer(model: mujoco.MjModel, height: int, width: int, samples: int) -> mujoco.Renderer:
    # Read when the context is made.
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    model.vis.quality.offsamples, model.vis.quality.shadowsize = samples, SHADOW * max(width, height) // PICTURE[1]
    try:
        return mujoco.Renderer(model, height, width)
    except Exception as error:  # each GL backend fails in its own way
        raise RenderError(
            f"MuJoCo cannot render off screen here ({error}). Set MUJOCO_GL=egl (or osmesa) and see `er-il doctor`."
        ) from error
