"""Our model on a GPU: simulated seconds per second of `mujoco_warp` (extra `gpu`).

    python -m benchmarks.gpu                               # N = 4096 and 16384 on the GPU
    python -m benchmarks.gpu --device cpu --sizes 4        # shows that it runs

The bodies begin in recorded walking states, all phases of the stride among them, and get the walk's own controls. The
physics steps of one control window are one CUDA graph, as they would be in training.
"""

import sys
from dataclasses import dataclass
from time import perf_counter
from typing import Annotated, Any

import mujoco
import numpy as np
import tyro

from springfoot.command_line import exit_code
from springfoot.envs.physics.model import build_model
from springfoot.envs.physics.timing import CONTROL_WINDOW
from springfoot.errors import SpringfootError, require_count
from springfoot.gait.body.body import GRAVITY, Body

from .walking import Walk, record_walk

RECORDED = 64
"""Bodies; their walk is repeated until there are N."""
CONTACTS, ROWS = 8, 64
"""Room for contacts and constraint rows of each body: six spheres, three rows each, and the joint stops."""


@dataclass(frozen=True, kw_only=True)
class Flags:
    """Time mujoco_warp on our model."""

    sizes: Annotated[tuple[int, ...], tyro.conf.arg(metavar="N ...")] = (4096, 16384)
    """Bodies side by side."""
    steps: int = 50
    """Environment steps of 20 ms in a round."""
    repeats: int = 5
    """Rounds, after one that compiles."""
    device: str = "cuda:0"
    """As Warp names it."""


def floor_forces(walk: Walk) -> np.ndarray:
    """Return the floor's force on each recorded body after 20 ms, by C MuJoCo: (RECORDED, 2), forward and up [N]."""
    model = build_model(Body())
    substeps = round(CONTROL_WINDOW / model.opt.timestep)
    found = np.empty((RECORDED, 2))
    for body, force in enumerate(found):
        data = mujoco.MjData(model)
        data.qpos, data.qvel = walk.position[0][body], walk.velocity[0][body]
        for window in walk.controls[0]:
            data.ctrl = window[body]
            mujoco.mj_step(model, data, substeps)
        force[:] = data.qfrc_constraint[:2]  # of the root's two slides: nothing but the floor pushes there
    return found


def rates(flags: Flags, walk: Walk, num: int) -> tuple[np.ndarray, float, float]:
    """Return simulated seconds per second of each round, and how far Warp is from C MuJoCo after 20 ms.

    The second value is the largest difference of an angle [rad] or of the root's place [m], the third the largest
    difference of the floor's force as a fraction of the body's weight.
    """
    wp, warp = _modules()
    model = build_model(Body())
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_MIDPHASE)  # C MuJoCo's own search, which Warp has not
    substeps = round(CONTROL_WINDOW / model.opt.timestep)
    copies = -(-num // RECORDED)

    def over_all(values: np.ndarray) -> np.ndarray:
        return np.tile(values, (copies, 1))[:num].astype(np.float32)

    with wp.ScopedDevice(flags.device):
        there = warp.put_model(model)
        data = warp.put_data(model, mujoco.MjData(model), nworld=num, nconmax=CONTACTS, njmax=ROWS)
        windows = [wp.array(over_all(window)) for step in walk.controls for window in step]
        position, velocity = (wp.array(over_all(values[0])) for values in (walk.position, walk.velocity))

        def advance() -> None:
            for _ in range(substeps):
                warp.step(there, data)

        def begin() -> None:
            warp.reset_data(there, data)
            wp.copy(data.qpos, position)
            wp.copy(data.qvel, velocity)
            wp.synchronize()

        begin()
        advance()  # compiles
        graph = None
        if wp.get_device().is_cuda:
            with wp.ScopedCapture() as capture:
                advance()
            graph = capture.graph
        found = []
        apart = force_apart = 0.0
        for _ in range(flags.repeats + 1):
            begin()
            clock = perf_counter()
            for index, window in enumerate(windows):
                wp.copy(data.ctrl, window)
                advance() if graph is None else wp.capture_launch(graph)
                if not found and index + 1 == len(walk.controls[0]):
                    apart = float(np.abs(data.qpos.numpy() - over_all(walk.position[1])).max())
                    force = data.qfrc_constraint.numpy()[:, :2] - over_all(floor_forces(walk))
                    force_apart = float(np.abs(force).max() / (GRAVITY * Body().mass))
            wp.synchronize()
            found.append(num * len(windows) * CONTROL_WINDOW / (perf_counter() - clock))
    return np.array(found[1:]), apart, force_apart


def _modules() -> tuple[Any, Any]:
    try:
        import mujoco_warp  # pyright: ignore[reportMissingImports]  # optional
        import warp  # pyright: ignore[reportMissingImports]  # optional
    except ImportError as error:
        raise SpringfootError(f"needs mujoco_warp: pip install 'springfoot[gpu]' ({error})") from None
    warp.config.log_level = warp.LOG_WARNING  # or it names every kernel it compiles
    return warp, mujoco_warp


def run(flags: Flags) -> None:
    """Time every size and print."""
    for name, count in [("steps", flags.steps), ("repeats", flags.repeats), *(("sizes", size) for size in flags.sizes)]:
        require_count(name, count)
    wp, _ = _modules()
    wp.init()
    if flags.device not in (known := [device.alias for device in wp.get_devices()]):
        raise SpringfootError(f"no device {flags.device!r} here; there are {', '.join(known)}")
    walk = record_walk(RECORDED, max(flags.steps, 2))
    print(
        f"{wp.get_device(flags.device).name}; simulated seconds per second, median (least to most) of {flags.repeats}"
    )
    for num in flags.sizes:
        found, apart, force = rates(flags, walk, num)
        low, middle, high = np.quantile(found, (0.0, 0.5, 1.0))
        print(
            f"N = {num:6d}: {middle:,.0f} ({low:,.0f} to {high:,.0f}); after 20 ms within {apart:.0e} of C MuJoCo, "
            f"forces of the floor within {force:.0e} of body weight"
        )


def main() -> int:
    """Exit code: 0 done, 2 bad input or nothing to run on, 130 ended by Ctrl-C."""
    flags = tyro.cli(Flags, prog="benchmarks.gpu")
    return exit_code("gpu", lambda: run(flags))


if __name__ == "__main__":
    sys.exit(main())
