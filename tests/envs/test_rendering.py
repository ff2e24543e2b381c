"""Pictures: frames without a screen, a window on one, and one clear line where there is no OpenGL.

Each runs in a process of its own, as OpenGL is chosen when MuJoCo is imported.
"""

import os
import shutil
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

FRAME = """
import numpy as np
from springfoot.envs import SegmentedFootBiped, SegmentedFootBipedVector
from springfoot.gait import SpringfootError
frame = None
env = SegmentedFootBiped(render_mode="rgb_array")
env.reset(seed=0)
try:
    frame = env.render()
except SpringfootError as error:
    print("hint" if "MUJOCO_GL" in str(error) else error)
else:
    env.step(np.zeros(4))
    moved = env.render()
    print("frame" if frame.shape == (480, 640, 3) and frame.std() > 5 and (moved != frame).any() else "blank")
env.step(np.zeros(4))
env.close()
env.close()
frames = SegmentedFootBipedVector(2, render_mode="rgb_array", height_range=(1.5, 1.9))
frames.reset(seed=0)
if frame is not None:
    one, other = frames.render()
    assert one.shape == other.shape == frame.shape and (one != other).any()
"""

CHECKERS = """
import sys
import warnings
warnings.simplefilter("error")
import gymnasium as gym
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_sb3
from springfoot.envs import SegmentedFootBiped
env = gym.make("SegmentedFootBiped-v0").unwrapped
env.metadata["render_modes"] = sys.argv[1:]
check_env(env)
for mode in sys.argv[1:]:
    check_env_sb3(SegmentedFootBiped(render_mode=mode, episode_seconds=0.5))
print("nothing to say")
"""

TWO_WINDOWS = """
import copy
import gymnasium as gym
import numpy as np
from springfoot.gait import SpringfootError
env = gym.make("springfoot.envs:SegmentedFootBiped-v0", render_mode="human")
env.reset(seed=0)
other = copy.deepcopy(env)
try:
    other.step(np.zeros(4))
except SpringfootError as error:
    print(error)
env.step(np.zeros(4))
env.close()
other.step(np.zeros(4))
"""

WINDOW = """
import select
import sys
import time
import gymnasium as gym
import numpy as np
env = gym.make("springfoot.envs:SegmentedFootBiped-v0", render_mode="human", height_range=(1.6, 1.9))
env.reset(seed=0)
print("open", flush=True)
began, steps = time.perf_counter(), 0
while not select.select([sys.stdin], [], [], 0)[0]:
    *_, terminated, truncated, _ = env.step(np.zeros(4, np.float32))
    steps += 1
    if terminated or truncated:
        env.reset()  # another body: another window
assert time.perf_counter() - began > 0.02 * (steps - 1), "faster than real time"
if sys.argv[1:]:
    env.close()
    env.reset(seed=1)  # opens a new one
"""


def run(code: str, *arguments: object, **environment: str) -> str:
    """What a program prints, which must end well; skips the test if it says that there is no OpenGL."""
    command = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | environment)
    if "cannot render: no OpenGL here" in done.stderr:
        pytest.skip(f"there is no OpenGL here for {environment}")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout.strip()


@pytest.fixture(scope="module")
def screen(tmp_path_factory):
    """A screen of 1280 x 800 without a monitor: what a program's environment says of it, and the file of its pixels."""
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is not installed")
    folder = tmp_path_factory.mktemp("screen")
    command = ["Xvfb", "-displayfd", "1", "-screen", "0", "1280x800x24", "-fbdir", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        try:
            number = process.stdout.readline().strip() if process.stdout else ""
            if not number:
                pytest.skip("Xvfb does not start here")
            yield {"DISPLAY": f":{number}", "MUJOCO_GL": "glfw"}, folder / "Xvfb_screen0"
        finally:
            process.terminate()


def pixels(path: Path) -> np.ndarray:
    """A picture in X's window dump format, (height, width, 3) as blue, green, red."""
    data = path.read_bytes()
    header = struct.unpack(">25I", data[:100])
    width, height, line, begin = header[4], header[5], header[12], header[0] + 12 * header[19]
    rows = np.frombuffer(data, np.uint8, offset=begin, count=line * height).reshape(height, line)
    return rows[:, : 4 * width].reshape(height, width, 4)[..., :3].astype(int)


@pytest.mark.slow
@pytest.mark.parametrize(("gl", "allowed"), [("disabled", ["hint"]), ("egl", ["frame", "hint"])])
def test_rendering_gives_a_frame_or_says_what_to_install(gl, allowed):
    assert run(FRAME, MUJOCO_GL=gl) in allowed


@pytest.mark.slow
def test_checkers_have_nothing_to_say_about_frames_without_a_screen():
    assert run(CHECKERS, "rgb_array", MUJOCO_GL="egl") == "nothing to say"


def test_checkers_have_nothing_to_say_about_windows(screen):
    environment, _ = screen
    assert run(CHECKERS, "human", **environment) == "nothing to say"


def test_a_second_window_is_refused_while_there_is_one(screen):
    environment, _ = screen
    assert run(TWO_WINDOWS, **environment) == (
        "cannot open a second window: a process has one at a time; close() the other environment of "
        'render_mode="human", or use render_mode="rgb_array"'
    )


@pytest.mark.parametrize("end", [[], ["close"]], ids=["left open", "closed"])
def test_human_mode_shows_the_walk_in_a_window_in_real_time(screen, end):
    environment, memory = screen
    command, pipe = [sys.executable, "-c", WINDOW, *end], subprocess.PIPE
    with subprocess.Popen(
        command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, env=os.environ | environment
    ) as walk:
        opened = walk.stdout.readline() if walk.stdout else ""
        shown = seen(memory, body_pixels) if opened else None
        moved = shown is not None and seen(memory, lambda now: int((np.abs(now - shown).max(-1) > 60).sum()))
        _, errors = walk.communicate("enough")
    if "cannot render: no OpenGL here" in errors:
        pytest.skip("there is no OpenGL on this screen")
    assert (walk.returncode, errors) == (0, "")
    assert shown is not None and moved is not None


def seen(memory: Path, amount: Callable[[np.ndarray], int]) -> np.ndarray | None:
    """A picture of the screen with an `amount` beyond 300 pixels; None if there is none for a minute."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        picture = pixels(memory)
        if amount(picture) > 300:
            return picture
        time.sleep(0.05)
    return None


def body_pixels(picture: np.ndarray) -> int:
    """How many are of an orange heel: a window whose camera does not stand to the side shows none."""
    blue, _, red = np.moveaxis(picture, -1, 0)
    return int(((red > 120) & (blue < 0.6 * red)).sum())
