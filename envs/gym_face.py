"""Share the parts of both Gymnasium environments: spaces, spec, options of a reset, pictures, pickling."""

from collections.abc import Mapping
from copy import copy
from typing import Any

import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.spaces import Box

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError, quoted

from .batch.biped_batch import Biped
from .control.subjects import GIVEN
from .physics.rendering import RENDER_MODES, Camera
from .physics.timing import ACTION_STEP
from .settings.checks import check_start, real_numbers
from .settings.feet import FOOT_SETTINGS, foot_setting
from .settings.settings import BipedSettings

METADATA: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": round(1 / ACTION_STEP)}


class Face:
    """A batch behind one of Gymnasium's interfaces: its spec, its camera, its pickling."""

    settings: BipedSettings
    biped: Biped
    render_mode: str | None
    metadata: dict[str, Any]
    _spec: EnvSpec | None = None
    _camera: Camera | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """Return the spec of `gym.make` or `make_vec`; its `max_episode_steps` are those of the settings."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        """Keep a copy of the spec, with the settings' `max_episode_steps`: they alone truncate this environment.

        A limit given to `gym.make` is kept by a wrapper, `TimeLimit`; its own spec names the limit.
        """
        self._spec = copy(spec)
        if self._spec is not None:
            self._spec.max_episode_steps = self.settings.max_episode_steps

    def __getstate__(self) -> dict[str, Any]:
        """Return everything but the camera: a copy opens a camera at its first picture."""
        return self.__dict__ | {"_camera": None}

    def _camera_for(self) -> Camera:
        """Return the camera, opened at its first use.

        Raise `SpringfootError` without a render mode, or without OpenGL.
        """
        if self.render_mode is None:
            modes = " or ".join(map(repr, RENDER_MODES))
            raise SpringfootError(f"make the environment with render_mode {modes} to render")
        self._camera = self._camera or Camera(self.biped.model, self.render_mode, self.metadata["render_fps"])
        return self._camera

    def _close_camera(self) -> None:
        """Close the camera, if it is open; the next picture opens another one."""
        if self._camera is not None:
            self._camera.close()
            self._camera = None


def spaces_of(biped: Biped) -> tuple[Box, Box]:
    """Return the spaces of one environment: observations (D,) within their bounds, and actions (A,) in [-1, 1]."""
    low = biped.observation_low
    high = biped.observation_high
    return Box(low, high, dtype=np.float32), Box(-1.0, 1.0, (len(biped.action_names),), np.float32)


def check_options(options: dict[str, Any] | None, further: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return the options of a reset, an empty dictionary for None.

    Raises `SpringfootError` for an unknown option and for a bad start; the values of the others are not checked here.
    `further` are names of options beside `start` and those of `GIVEN`, which this interface allows.
    """
    options = {} if options is None else options
    allowed = ("start", *GIVEN, *further)
    if not isinstance(options, Mapping):
        raise SpringfootError(f"reset options must be a dictionary, got {quoted(options)}")
    for name in options:
        if name not in allowed:
            raise SpringfootError(f"unknown reset option {quoted(name)}; valid: {', '.join(allowed)}")
    if "start" in options:
        check_start(options["start"])
    return options


def given_subjects(options: dict[str, Any], num: int) -> dict[str, NDArray]:
    """Return name of `GIVEN` -> (N,) values of the bodies, speeds and feet that the options of a reset set; N is `num`.

    Names that are not among the options are left out.
    Raises `SpringfootError` for a value that is neither a number (a foot) nor one for each environment.
    """
    given = {}
    for name in GIVEN:
        if name in FOOT_SETTINGS and name in options:
            given[name] = _feet_of_all(name, options[name], num)
        elif name in options:
            try:
                given[name] = np.broadcast_to(real_numbers(name, options[name]), (num,))
            except ValueError:
                raise SpringfootError(
                    f"reset option {name!r} must be a number, or one for each of {num} environments, "
                    f"got {quoted(options[name])}"
                ) from None
    return given


def _feet_of_all(name: str, feet: Any, num: int) -> NDArray:
    """Return the feet of N environments, (N,) of `FootSetting`, from the reset option `name`: a foot, or a list."""
    listed = feet if isinstance(feet, (list, tuple, np.ndarray)) else [feet] * num
    if len(listed) != num:
        raise SpringfootError(
            f"reset option {name!r} must be a foot, or a list of one for each of {num} environments, got {quoted(feet)}"
        )
    checked = np.empty(num, object)  # np.array could make an axis of a foot's entries
    checked[:] = [foot_setting(f"reset option {name!r}", foot) for foot in listed]
    return checked


def check_render_mode(mode: str | None) -> str | None:
    """Return the render mode; raise `SpringfootError` for an unknown one."""
    if mode is not None and not (isinstance(mode, str) and mode in RENDER_MODES):
        raise SpringfootError(f"render_mode must be None or one of {', '.join(RENDER_MODES)}, got {quoted(mode)}")
    return mode
