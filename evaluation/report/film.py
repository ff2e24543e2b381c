"""Write walk.mp4: the first seconds of the walk as MuJoCo draws it; needs OpenGL and the extra `film`."""

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import mujoco

from springfoot.envs.physics.rendering import HEIGHT, WIDTH, Camera
from springfoot.errors import SpringfootError

from ..recording.recording import TICK, Recording
from .exports import postures, sloping_spec

FILM_SECONDS = 10.0
"""Longest film [s]; chosen."""
TICKS_A_FRAME = 4
"""Ticks of 10 ms from one picture to the next: 25 a second, in real time."""
QUALITY = 7
"""Quality of the encoder, 0 to 10; chosen."""


def require_film() -> None:
    """Raise `SpringfootError`, with the remedy, if no film can be made."""
    if find_spec("imageio_ffmpeg") is None:
        raise SpringfootError("a film needs an encoder: pip install 'springfoot[film]'")
    Camera(mujoco.MjSpec().compile(), "rgb_array", 1.0).close()


def film_seconds(recording: Recording) -> float:
    """Return the length of the film [s]."""
    return min(FILM_SECONDS, TICK * int(recording.ticks[recording.example]))


def save_film(path: Path, recording: Recording, progress: Callable[[float], object] = lambda seconds: None) -> None:
    """Write the film of a recording's `example`; call `progress` with the seconds of film that each picture adds.

    Raises `SpringfootError` without OpenGL or an encoder, and if the encoder fails.
    """
    require_film()
    import imageio_ffmpeg  # pyright: ignore[reportMissingImports]  # optional

    model = sloping_spec(recording).compile()
    per_second = round(1 / (TICK * TICKS_A_FRAME))
    data = mujoco.MjData(model)
    camera = Camera(model, "rgb_array", per_second)
    try:
        writer: Any = imageio_ffmpeg.write_frames(
            str(path), (WIDTH, HEIGHT), fps=per_second, quality=QUALITY, ffmpeg_log_level="error"
        )
        writer.send(None)  # begins: the writer is a generator
        for posture in postures(recording)[: round(FILM_SECONDS / TICK) : TICKS_A_FRAME]:
            data.qpos[:] = posture
            mujoco.mj_forward(model, data)
            writer.send(camera.show(data))
            progress(TICK * TICKS_A_FRAME)
        writer.close()
    except (OSError, RuntimeError) as error:
        raise SpringfootError(f"the encoder failed: {str(error).strip().splitlines()[-1]}") from None
    finally:
        camera.close()
