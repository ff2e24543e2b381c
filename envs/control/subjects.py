"""Draw and hold the body and the commanded speed of each environment of a batch.

Mechanics scale exactly (`envs.physics.model`). So curves are tabulated for one body, that of the settings, at a few
speeds (`envs.control.reference_walk`). Each environment has the ratios of its body to that one, and a place in the
tables between the two speeds nearest to its own Froude speed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import radians, sqrt
from typing import Any

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError
from springfoot.gait.body.body import Body

from ..physics.kernel import kernel
from ..settings.drawn import draw_index
from ..settings.feet import FOOT_SETTINGS
from ..settings.settings import BipedSettings, body_of, settings_of_bodies
from .state import CONTROL_ROW

DRAWN: tuple[str, ...] = ("height", "mass", "speed")
"""Quantities that can be drawn for each environment: settings `<name>_range`, and options of a reset."""
GIVEN = (*DRAWN, "body", *FOOT_SETTINGS)
"""Options of a reset in place of drawn values: those of `DRAWN`, the index of a body of `drawn_bodies`, feet."""
MOST_DRAWS = 1000
"""Bodies drawn for one reset before it fails; chosen, as few pairs from wide ranges of height and mass make a body."""


@kernel
def _approach(most, running, subjects):
    """Change the commanded speeds of environments `running` (N,) by at most `most` [m/s], towards those drawn last.

    `subjects` is (N,) of `SUBJECT`. Returns True if any speed has not reached its target, also of an environment that
    does not run now: it changes once that runs again.
    """
    under_way = False
    for i in range(len(subjects)):
        subject = subjects[i]
        difference = subject.target - subject.speed
        if running[i]:
            if abs(difference) <= most:
                subject.speed = subject.target
            else:
                subject.speed += most if difference > 0.0 else -most
        under_way = under_way or subject.speed != subject.target
    return under_way


@kernel
def _find_places(ids, speeds, first, subjects):
    """Set the `place` of environments `ids` (K,) in tables over `speeds` (G,) [m/s], by their Froude-equal speeds.

    `first` (N,) is the first row of each environment's variant of the leg constants; `subjects` (N,) of `SUBJECT`.
    """
    last = len(speeds) - 1
    for i in ids:
        equal_speed = subjects[i].speed / subjects[i].scale.time  # of the settings' body: speeds scale as times do
        lower = 0  # index of the tabulated speed below, never the last one where there are two
        while lower < last - 1 and equal_speed >= speeds[lower + 1]:
            lower += 1
        weight = 0.0
        if last > 0:
            weight = min(max((equal_speed - speeds[lower]) / (speeds[lower + 1] - speeds[lower]), 0.0), 1.0)
        if weight == 1.0:  # at the next speed itself: its row alone is then read
            lower = lower + 1
            weight = 0.0
        subjects[i].place.row = first[i] + lower
        subjects[i].place.weight = weight


class Subjects:
    """Bodies and commanded speeds of N environments; arrays are changed in place.

    Args:
        settings: the body of the tables, and the ranges to draw from.
        speeds: (G,) tabulated speeds [m/s], ascending (`envs.control.reference_walk.tabulated_speeds`).
        num: number N of environments.
        variant: (N,) index of each environment's table, if there are several.
        variants: number of such tables; each body of `drawn_bodies` has as many.
    """

    def __init__(
        self, settings: BipedSettings, speeds: NDArray, num: int, variant: NDArray | None = None, variants: int = 1
    ):
        self._settings = settings
        # The bodies that the tables were made for, one for each of the drawn proportions; all have one height and mass.
        self._table_bodies = [body_of(one) for one in settings_of_bodies(settings)]
        self._usual = self._table_bodies[0]
        self._speeds = speeds
        self._variant = np.zeros(num, int) if variant is None else np.asarray(variant, int)
        self._variants = variants
        self.proportions = np.zeros(num, int)
        """(N,) index of each environment's body in `drawn_bodies`; 0 without them."""
        self.bodies = [self._usual] * num
        """Body of each environment."""
        self.rows = np.zeros(num, CONTROL_ROW)
        """(N,) row of the control for each environment."""
        # The arrays below are views into `rows`, which the kernels read.
        subjects = self.rows["subject"]
        self.place = subjects["place"]
        """(N,) place of the commanded speed in tables of variants x speeds."""
        self.scale = subjects["scale"]
        """(N,) ratios of the bodies to that of the settings."""
        self.speed = subjects["speed"]
        """(N,) present commanded speed [m/s]."""
        self.target = subjects["target"]
        """(N,) speed to which the commanded speed goes [m/s]."""
        self._next_draw = subjects["change"]  # (N,) time at which the next target is drawn [s]
        self.slope = subjects["slope"]
        """(N,) slope of the ground [rad], uphill positive; set by `envs.task.ground`."""
        subjects["height"] = self._usual.height
        subjects["mass"] = self._usual.mass
        self.scale[:] = 1.0
        self.speed[:] = self.target[:] = settings.speed
        self.slope[:] = radians(settings.slope_deg)
        self._next_draw[:] = np.inf
        self._speeds_move = False
        self._everyone = np.arange(num)
        self._locate(self._everyone)

    def reset(
        self, ids: NDArray, randoms: Sequence[np.random.Generator], given: Mapping[str, Any] | None = None
    ) -> list[int]:
        """Draw a body and a commanded speed for each environment in `ids` (K,).

        Args:
            ids: (K,) indices.
            randoms: K generators.
            given: name of `GIVEN` -> values (K,) in place of drawn ones; feet among them are not read (`WornFeet`).

        Returns the indices of environments with a changed body; their models must be rebuilt. Raises `SpringfootError`,
        leaving all state unchanged, for an impossible body or a speed outside the tables.
        """
        numbers = {name: values for name, values in (given or {}).items() if name not in FOOT_SETTINGS}
        drawn = [
            self._draw(random, {name: float(values[row]) for name, values in numbers.items()})
            for row, random in enumerate(randoms)
        ]
        changed = self._embody(ids, [body for body, _, _ in drawn], [proportions for _, proportions, _ in drawn])
        for index, random, (_, _, speed) in zip(ids.tolist(), randoms, drawn, strict=True):
            self.speed[index] = self.target[index] = speed
            self._next_draw[index] = self._next_change(0.0, random)
        self._locate(ids)
        return changed

    def embody(self, ids: NDArray, height: NDArray, mass: NDArray, proportions: NDArray) -> list[int]:
        """Give environments `ids` (K,) bodies of `height` (K,) [m], `mass` (K,) [kg] and `proportions` (K,), indices in
        `drawn_bodies`; return the indices of those with a changed body, as `reset` does."""
        if not set(proportions.tolist()) <= set(range(len(self._table_bodies))):
            raise SpringfootError(
                f"the state does not fit: 'proportions' must be from 0 to {len(self._table_bodies) - 1}"
            )
        sizes = zip(height.tolist(), mass.tolist(), proportions.tolist(), strict=True)
        bodies = [replace(self._table_bodies[p], height=h, mass=m) for h, m, p in sizes]
        self._speeds_move = True  # the next step finds out whether a speed has to change
        return self._embody(ids, bodies, proportions.tolist())

    def _embody(self, ids: NDArray, bodies: Sequence[Body], proportions: Sequence[int]) -> list[int]:
        """Give environments `ids` (K,) these K bodies, `proportions` (K,) being indices in `drawn_bodies`.

        Returns the indices of the environments with a changed body.
        """
        changed = []
        self.proportions[ids] = proportions
        for index, body in zip(ids.tolist(), bodies, strict=True):
            if body != self.bodies[index]:
                changed.append(index)
                self.bodies[index] = body
                length = body.height / self._usual.height
                mass = body.mass / self._usual.mass
                self.scale[index] = length, sqrt(length), mass, mass * length  # the fields of `SCALE`
                self.rows["subject"][["height", "mass"]][index] = body.height, body.mass
        return changed

    def command(self, ids: NDArray, speed: NDArray) -> None:
        """Let the commanded speed of environments `ids` (K,) go to `speed` (K,) [m/s], at the setting `speed_rate`."""
        for index, value in zip(ids.tolist(), speed.tolist(), strict=True):
            self._require_covered(self.bodies[index], value)
        self.target[ids] = speed
        self._speeds_move = True

    def begin(self, ids: NDArray, speed: NDArray) -> None:
        """Set the commanded speed of environments `ids` (K,) to `speed` (K,) [m/s]; it then goes to its target."""
        self.speed[ids] = speed
        self._speeds_move = True

    def end(self, ids: NDArray, speed: NDArray) -> None:
        """Let the commanded speed of environments `ids` (K,) go to `speed` (K,) [m/s], and then stay there."""
        self.target[ids] = speed
        self._next_draw[ids] = np.inf
        self._speeds_move = True

    def advance(self, steps: NDArray, randoms: Sequence[np.random.Generator | None], walking: NDArray) -> bool:
        """Let a step pass for the `walking` (N,) environments, which have done `steps` (N,) before; draw new speeds
        to approach where that is due. Return False if no commanded speed can have changed."""
        settings = self._settings
        if settings.speed_interval is not None:
            time = steps * settings.step_seconds
            for index in np.flatnonzero(walking & (time >= self._next_draw)).tolist():
                random = randoms[index]
                if random is not None and settings.speed_range is not None:
                    self.target[index] = random.uniform(*settings.speed_range)
                    self._next_draw[index] = self._next_change(time[index], random)
                    self._speeds_move = True
        if not self._speeds_move:
            return False
        self._speeds_move = _approach(settings.speed_rate * settings.step_seconds, walking, self.rows["subject"])
        self._locate(self._everyone)
        return True

    def table_body(self, index: int) -> Body:
        """Return the body that the tables of environment `index` were made for, of the settings' height and mass."""
        return self._table_bodies[self.proportions[index]]

    def check(self, given: Mapping[str, Any] | None) -> None:
        """Raise `SpringfootError` for a `body` in `given`, as in `reset`, that is no index in `drawn_bodies`."""
        bodies = self._settings.drawn_bodies
        for index in (given or {}).get("body", ()):
            if bodies is None:
                raise SpringfootError("the reset option body is an index in the setting drawn_bodies, which is None")
            if index not in range(len(bodies)):
                raise SpringfootError(
                    f"the reset option body must be a whole number from 0 to {len(bodies) - 1}, got {index:g}"
                )

    def _draw(self, random: np.random.Generator, given: dict[str, float]) -> tuple[Body, int, float]:
        """Draw proportions and speed, then bodies until one is possible; values in `given` replace drawn ones.

        Return body, proportions and speed.
        """
        settings = self._settings
        proportions = draw_index(settings.drawn_bodies, random) if settings.drawn_bodies else 0
        proportions = int(given.pop("body", proportions))
        ranges = {name: getattr(settings, f"{name}_range") for name in DRAWN}
        values = {name: getattr(settings, name) for name in DRAWN}
        if ranges["speed"]:
            values["speed"] = random.uniform(*ranges["speed"])
        values |= given
        for draws_left in range(MOST_DRAWS, 0, -1):
            drawn = {name: random.uniform(*ranges[name]) for name in ("height", "mass") if ranges[name]}
            chosen = values | drawn | given
            try:
                body = replace(self._table_bodies[proportions], height=chosen["height"], mass=chosen["mass"])
                break
            except SpringfootError:
                if draws_left == 1 or not drawn.keys() - given.keys():  # another draw would give the same body
                    raise
        self._require_covered(body, values["speed"])
        return body, proportions, values["speed"]

    def _next_change(self, time: float, random: np.random.Generator) -> float:
        """Return the time [s] after `time` at which the next speed is drawn: 0.5 to 1.5 intervals later; inf without
        an interval."""
        interval = self._settings.speed_interval
        return np.inf if interval is None else time + interval * random.uniform(0.5, 1.5)

    def _require_covered(self, body: Body, speed: float) -> None:
        """Raise `SpringfootError` for a speed that the tables do not cover for this body."""
        time_scale = sqrt(body.height / self._usual.height)
        low = self._speeds[0] * time_scale
        high = self._speeds[-1] * time_scale
        if not low - 1e-9 <= speed <= high + 1e-9:  # an end itself may err by rounding
            raise SpringfootError(
                f"speed of a body of {body.height:.4g} m must be in [{low:.4g}, {high:.4g}] m/s, got {speed:.4g}; "
                "speed_range and height_range say which speeds and bodies the tables are made for"
            )

    def _locate(self, ids: NDArray) -> None:
        """Set `place`, the rows of the tables to read, for the commanded speeds of environments `ids` (K,)."""
        first = (self.proportions * self._variants + self._variant) * len(self._speeds)
        _find_places(ids, self._speeds, first, self.rows["subject"])
