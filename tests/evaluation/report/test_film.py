"""walk.mp4: what MuJoCo draws of the recorded walk, where there are OpenGL and an encoder; else one line that helps.

Each in a process of its own, as OpenGL is chosen when MuJoCo is imported.
"""

import subprocess
import sys

import numpy as np
import pytest

FILM = """
import sys
from pathlib import Path
from springfoot.evaluation.report.film import film_seconds, save_film
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import record
from springfoot.gait import SpringfootError
policy, settings = policy_and_settings("schedule", {"episode_seconds": 1.0, "slope_deg": 3.0})
recording, told = record(policy, settings, name="schedule", episodes=1), []
try:
    save_film(Path("walk.mp4"), recording, told.append)
except SpringfootError as error:
    print(error)
else:
    print("filmed", film_seconds(recording), round(sum(told), 6))
"""


def filmed(tmp_path, gl, script=FILM):
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env={"MUJOCO_GL": gl, "PATH": "/usr/bin:/bin", "OMP_NUM_THREADS": "1"},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_a_film_is_the_walk_in_real_time(tmp_path):
    encoder = pytest.importorskip("imageio_ffmpeg", reason="needs the extra film: pip install imageio-ffmpeg")
    said = filmed(tmp_path, "egl")
    if "OpenGL" in said:
        pytest.skip("needs OpenGL without a screen: install libegl1")
    assert said == "filmed 1.0 1.0"
    raw = [encoder.get_ffmpeg_exe(), "-i", "walk.mp4", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    read = subprocess.run(raw, cwd=tmp_path, capture_output=True, check=True)
    assert b"640x480" in read.stderr and b"25 fps" in read.stderr
    frames = np.frombuffer(read.stdout, np.uint8).reshape(-1, 480, 640, 3).astype(int)
    assert len(frames) == 25
    blue = [frame[..., 2] - frame[..., 0] > 60 for frame in frames]  # the body's bones
    assert all(0.005 < each.mean() < 0.2 for each in blue)
    columns = np.flatnonzero(blue[12].any(axis=0))
    assert 150 < columns.mean() < 490  # in the middle of the picture
    assert np.abs(frames[12] - frames[0]).mean() > 0.5  # it moves


def test_without_opengl_or_without_an_encoder_one_line_says_what_helps(tmp_path):
    pytest.importorskip("imageio_ffmpeg", reason="needs the extra film: pip install imageio-ffmpeg")
    assert filmed(tmp_path, "disable").startswith("cannot render: no OpenGL here")
    hidden = "import sys\nsys.modules['imageio_ffmpeg'] = None\n"
    hidden += "import importlib.util\nimportlib.util.find_spec = lambda name: None\n"
    assert filmed(tmp_path, "egl", hidden + FILM) == "a film needs an encoder: pip install 'springfoot[film]'"
    assert list(tmp_path.iterdir()) == []
