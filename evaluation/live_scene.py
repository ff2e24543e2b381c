"""The body of a live walk in 3-D: mjviser draws the model, the ground runs below it, arrows are its ground forces.

The body stays in the middle of the picture, however far it walks: ground and forces are moved back by its place.
"""

from copy import copy

import numpy as np
import viser
from mjviser import ViserMujocoScene

from springfoot.envs.physics.model import SIDES
from springfoot.gait.arrays import NDArray

from .live_session import LiveSession

FORCE_LENGTH = 0.55
"""Length of the arrow of one body weight [m]; chosen, as in walk.gif."""
FORCE_COLOUR = (213, 94, 0)
HIDDEN_GROUP = 3
"""A group of geoms that mjviser does not show unless asked."""


class LiveScene:
    """Draws what walks in `session` on the page of `server`."""

    def __init__(self, server: viser.ViserServer, session: LiveSession):
        self._server, self._session = server, session
        server.initial_camera.position, server.initial_camera.look_at = (0.5, -2.6, 1.0), (0.15, 0.0, 0.75)
        self._begin()

    def show(self) -> None:
        """Draw the body as it stands now."""
        session = self._session
        if session.model is not self._model:
            self._server.scene.reset()
            self._begin()
        data, slope = session.data(), np.radians(session.wishes.slope_deg)
        x = float(data.qpos[0])
        away = np.array([x, 0.0, x * np.tan(slope)])
        data.xpos[:] -= away
        with self._server.atomic():
            self._body.update_from_mjdata(data)
            along = (-x / np.cos(slope)) % 1.0  # the grid repeats itself every metre
            self._ground.position = (along * np.cos(slope), 0.0, along * np.sin(slope))
            self._forces.points = _arrows(session.frame.force, data.xpos[self._feet], away)

    def _begin(self) -> None:
        self._model = self._session.model
        drawn = copy(self._model)  # mjviser changes colours and sizes of what it draws
        drawn.geom_group[[drawn.geom(f"ground_{side}").id for side in SIDES]] = HIDDEN_GROUP
        self._feet = [drawn.body(f"foot_{side}").id for side in SIDES]
        self._body = ViserMujocoScene(self._server, drawn, num_envs=1)
        self._body.camera_tracking_enabled = False
        turn = -np.radians(self._session.wishes.slope_deg) / 2
        self._ground = self._server.scene.add_grid(
            "/ground",
            infinite_grid=True,
            fade_distance=12.0,
            wxyz=(np.cos(turn), 0.0, np.sin(turn), 0.0),
        )
        self._forces = self._server.scene.add_arrows(
            "/forces", np.zeros((2, 2, 3)), FORCE_COLOUR, shaft_radius=0.012, head_radius=0.03, head_length=0.06
        )


def _arrows(force: NDArray, feet: NDArray, away: NDArray) -> NDArray:
    """(side, (start, end), 3) arrows of `force` as in a `Frame`, in the planes of the `feet` (side, 3); without a force
    they have no length."""
    points = np.zeros((len(force), 2, 3), np.float32)
    for side, (place, height, forward, up) in enumerate(force):
        start = np.array([place, feet[side, 1], height]) - away * (1, 0, 1)
        points[side] = start, start + FORCE_LENGTH * np.array([forward, 0.0, up])
    return points
