"""Draw the body of a live walk in 3-D: its segments and load, the ground that runs below, arrows of its ground forces.

The body stays in the middle of the picture, however far it walks: ground and forces are shifted back by the distance.
Meshes are coarse, and lights cast no shadow and reflect nothing, so that a browser without a GPU can draw them.
"""

import mujoco
import numpy as np
import trimesh
import viser

from springfoot.arrays import NDArray
from springfoot.envs.physics.model import SIDES

from .steered_walk import LiveSession

FORCE_LENGTH = 0.55
"""Length of the arrow of one body weight [m]; chosen, as in walk.gif."""
FORCE_COLOUR = (213, 94, 0)
GROUND_COLOUR = (190, 190, 190)
GROUND_LENGTH, GROUND_WIDTH, GROUND_CELL = 14.0, 4.0, 0.5
"""Size and cell of the grid below the body [m]; a metre is a whole number of cells."""
ROUND = 16
"""Faces around a capsule; chosen, with half as many along each of its ends."""
DAYLIGHT, SUN = 1.6, 2.2
"""Intensities of light from all sides and from one side [-]; chosen by eye."""


NARROW = 600
"""Width of a picture in which the panel of inputs lies over the lower part [pixels]: telephones, as viser has it."""
WIDE = 1200
"""Least width of a picture that has room for the body between curves and inputs [pixels]; chosen."""
INPUTS_WIDTH = 420
"""Width that the panel of inputs covers on the right of a picture from `NARROW` on [pixels]."""
STANDPOINT = (0.5, -2.6, 1.0)
"""Initial place of the camera [m], beside the walk."""
MIDDLE = (0.15, 0.0, 0.75)
"""Initial middle of the picture [m]."""
NARROW_STANDPOINT, NARROW_MIDDLE = (0.7, -4.2, 1.3), (0.15, 0.0, -1.2)
"""Likewise of a narrow picture [m]: so far and so low that the whole body walks above the panel; chosen by eye."""


def fit_to_screen(client: viser.ClientHandle) -> None:
    """Move the camera of a new browser with a picture that is not wide, so that the panel of inputs does not hide the
    body."""
    camera = client.camera
    if camera.image_width < NARROW:
        camera.position = NARROW_STANDPOINT
        camera.look_at = NARROW_MIDDLE
    elif camera.image_width < WIDE:
        # Half of the panel's width, in metres where the body walks: the body is in the middle of the free part.
        metres_a_pixel = -2 * STANDPOINT[1] * np.tan(camera.fov / 2) / camera.image_height
        aside = np.array([INPUTS_WIDTH / 2 * metres_a_pixel, 0.0, 0.0])
        camera.position = STANDPOINT + aside
        camera.look_at = MIDDLE + aside


class LiveScene:
    """Draw the body of `session` on the page of `server`."""

    def __init__(self, server: viser.ViserServer, session: LiveSession):
        self._server = server
        self._session = session
        server.initial_camera.position = STANDPOINT
        server.initial_camera.look_at = MIDDLE
        self._begin()

    def show(self) -> None:
        """Build the scene if the model is new; draw the body in its present posture, shifted back by the way it has
        walked."""
        session = self._session
        if session.model is not self._model:
            self._server.scene.reset()
            self._begin()
        data = session.data()
        slope = np.radians(session.wishes.slope_deg)
        x = float(data.qpos[0])  # of the hip
        walked = np.array([x, 0.0, x * np.tan(slope)])  # along the slope, by which everything is shifted back
        data.xpos[:] -= walked
        with self._server.atomic():
            for body, frame in self._bodies.items():
                frame.position = data.xpos[body]
                frame.wxyz = data.xquat[body]
            along = (-x / np.cos(slope)) % 1.0  # the grid repeats itself every metre
            self._ground.position = (along * np.cos(slope), 0.0, along * np.sin(slope))
            self._forces.points = _force_arrows(session.frame.force, data.xpos[self._feet], walked)

    def _begin(self) -> None:
        """Build the scene of a new model: ground, body, arrows."""
        model = self._model = self._session.model
        self._feet = [model.body(f"foot_{side}").id for side in SIDES]
        scene = self._server.scene
        scene.configure_default_lights(False)
        scene.configure_environment_map(None)
        scene.add_light_ambient("/daylight", intensity=DAYLIGHT)
        scene.add_light_directional("/sun", intensity=SUN, position=(2.0, -3.0, 4.0))
        self._bodies = {body: scene.add_frame(_name(body), show_axes=False) for body in range(1, model.nbody)}
        for geom in np.flatnonzero(model.geom_bodyid).tolist():  # body 0 is the world: its ground is drawn as a grid
            self._add_geom(geom)
        # Half the angle, for a quaternion; negative, as a positive turn about y moves forward (x) down.
        turn = -np.radians(self._session.wishes.slope_deg) / 2
        self._ground = scene.add_line_segments(
            "/ground",
            _grid_lines(),
            GROUND_COLOUR,
            thickness=0.7,
            thickness_units="screen",
            wxyz=(np.cos(turn), 0.0, np.sin(turn), 0.0),
        )
        self._forces = scene.add_arrows(
            "/forces",
            np.zeros((len(SIDES), 2, 3)),
            FORCE_COLOUR,
            shaft_radius=0.012,
            head_radius=0.03,
            head_length=0.06,
        )

    def _add_geom(self, geom: int) -> None:
        """Draw the capsule, sphere or box with the number `geom` in the model, on its body."""
        model = self._model
        radius, half_length = model.geom_size[geom, :2]
        name = f"{_name(model.geom_bodyid[geom])}/{geom}"
        colour = tuple(model.geom_rgba[geom, :3].tolist())
        pose = {"wxyz": model.geom_quat[geom], "position": model.geom_pos[geom]}
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CAPSULE:
            mesh = trimesh.creation.capsule(2.0 * half_length, radius, count=(ROUND // 2, ROUND))
            self._server.scene.add_mesh_simple(name, mesh.vertices, mesh.faces, color=colour, **pose)
        elif model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
            self._server.scene.add_box(name, colour, 2.0 * model.geom_size[geom], **pose)
        else:
            self._server.scene.add_icosphere(name, radius, colour, subdivisions=2, **pose)


def _name(body: int) -> str:
    """Return the name in viser's scene of the body that has the number `body` in the model."""
    return f"/body/{body}"


def _grid_lines() -> NDArray:
    """Return the lines of the ground's grid, across it and along it, (line, (start, end), (x, y, z)) [m]."""
    along = GROUND_LENGTH / 2
    across = GROUND_WIDTH / 2
    xs = np.arange(-along, along + GROUND_CELL, GROUND_CELL)
    ys = np.arange(-across, across + GROUND_CELL, GROUND_CELL)
    lines = [((x, -across, 0.0), (x, across, 0.0)) for x in xs] + [((-along, y, 0.0), (along, y, 0.0)) for y in ys]
    return np.array(lines, np.float32)


def _force_arrows(force: NDArray, feet: NDArray, walked: NDArray) -> NDArray:
    """Return the arrows of the ground reaction forces, (side, (start, end), (x, y, z)) [m].

    `force` (side, 4) is that of a `Frame`. Arrows stand in the planes of the `feet` (side, (x, y, z)) [m] and are
    shifted back by `walked` (x, y, z) [m], as the drawn body is. An arrow of no force has no length.
    """
    points = np.zeros((len(force), 2, 3), np.float32)
    for side, (x, height, forward, up) in enumerate(force):
        start = np.array([x, feet[side, 1], height]) - walked * (1, 0, 1)  # the feet's y is not shifted
        points[side] = start, start + FORCE_LENGTH * np.array([forward, 0.0, up])
    return points
