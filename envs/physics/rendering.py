"""Draw pictures of one body. No other module needs OpenGL, and this one only when it draws a frame."""

import atexit
import threading
import time
import warnings
import weakref
from typing import Any

import mujoco

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError

RENDER_MODES = ("human", "rgb_array")
WIDTH, HEIGHT = 640, 480
"""Size of a frame [pixels]."""
CAMERA = "track"
"""Name of the model's camera, which follows the body's CoM."""
CLOSING_SECONDS = 5.0
"""Longest wait for a window to be gone [s]; chosen, it takes a few frames."""

NO_GL = (
    "cannot render: no OpenGL here ({}). Without a screen install libosmesa6 or libegl1 and set MUJOCO_GL=osmesa or "
    "MUJOCO_GL=egl before Python starts; everything but rendering works without"
)
ONE_WINDOW = (
    'cannot open a second window: a process has one at a time; close() the other environment of render_mode="human", '
    'or use render_mode="rgb_array"'
)


class Camera:
    """Draw bodies, one model at a time, in a window ("human") or into arrays ("rgb_array").

    Raises `SpringfootError` with a hint without OpenGL, or without a screen for a window; and for a second window in a
    process: each draws in a thread of its own, and GLFW is not made for several.
    """

    _with_window: "weakref.ref[Camera] | None" = None

    def __init__(self, model: mujoco.MjModel, mode: str, frames_per_second: float) -> None:
        self._mode = mode
        self._period = 1 / frames_per_second
        self._next_frame = 0.0
        self._window: Any = None
        self._drawing: list[threading.Thread] = []
        self._renderer: Any = None
        self._open(model)

    def _open(self, model: mujoco.MjModel) -> None:
        """Open a renderer or a window for a model."""
        self._model = model
        if self._mode == "human":
            other = Camera._with_window and Camera._with_window()  # None once that camera is gone
            if other and other._window is not None and other._window.is_running():
                raise SpringfootError(ONE_WINDOW)
            Camera._with_window = weakref.ref(self)
            self._data = mujoco.MjData(model)
            self._window, self._drawing = _open_window(model, self._data)
        else:
            self._renderer = _renderer(model)
        atexit.register(_close, weakref.ref(self))  # runs before the end of OpenGL, which was registered earlier

    def show(self, data: mujoco.MjData, model: mujoco.MjModel | None = None) -> NDArray | None:
        """Return one frame of `data`: uint8 (HEIGHT, WIDTH, 3), or None after drawing it in the window in real time.

        `model` is that of `data`; None stands for the model of the last frame. Another model opens a new window.
        """
        if model is not None and model is not self._model:
            self.close()
            self._open(model)
        if self._renderer is not None:
            self._renderer.update_scene(data, camera=CAMERA)
            return self._renderer.render()
        if self._window.is_running():
            with self._window.lock():
                mujoco.mj_copyData(self._data, self._model, data)
            self._window.sync()
            time.sleep(max(0.0, self._next_frame - time.perf_counter()))
            self._next_frame = time.perf_counter() + self._period
        return None

    def close(self) -> None:
        """Give back window and OpenGL context; a second call does nothing."""
        if self._renderer is not None:
            self._renderer.close()
        if self._window is not None:
            self._window.close()
            for thread in self._drawing:
                thread.join(CLOSING_SECONDS)
        self._window = self._renderer = None

    def __del__(self) -> None:
        self.close()


def _close(camera: "weakref.ref[Camera]") -> None:
    """Close a camera as Python exits, if it still exists."""
    still_there = camera()
    if still_there is not None:
        still_there.close()


def _renderer(model: mujoco.MjModel) -> Any:
    """Return a renderer into arrays for a model; raise `SpringfootError` without OpenGL."""
    try:
        return mujoco.Renderer(model, HEIGHT, WIDTH)
    except Exception as error:  # each backend fails in its own way
        raise SpringfootError(NO_GL.format(_first_line(error))) from None


def _open_window(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Any, list[threading.Thread]]:
    """Return a window that shows `data`, and the thread that draws it, if it has one of its own.

    Raises `SpringfootError` without a screen or OpenGL.
    """
    others = threading.enumerate()
    try:
        import glfw
        import mujoco.viewer

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of glfw, which would say the same in words of its own
            if not glfw.init():  # without this check launch_passive would wait for ever
                raise RuntimeError("no screen")
        window = mujoco.viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=False)
        drawing = [thread for thread in threading.enumerate() if thread not in others and thread.daemon]
    except Exception as error:
        raise SpringfootError(NO_GL.format(_first_line(error))) from None
    with window.lock():
        window.cam.type = mujoco.mjtCamera.mjCAMERA_FIXED
        window.cam.fixedcamid = model.camera(CAMERA).id
    return window, drawing


def _first_line(error: Exception) -> str:
    """Return the first line of an error's text, or the name of its class if it has no text."""
    return (str(error) or type(error).__name__).splitlines()[0]
