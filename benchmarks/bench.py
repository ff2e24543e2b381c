"""What a step costs beside its physics: CPU time of the full batched step over that of `mj_step` alone.

    make bench

Both run in one process, in turn, step by step: the batch steps N walking bodies for 20 ms (observation, reward and
info included); then `mujoco.mj_step(model, data, nstep)` repeats the same physics steps from the same states with the
same controls. Ratios of such pairs do not depend on how busy or how fast the machine is.
"""

import time

import mujoco
import numpy as np

from springfoot.envs.actuation import action_of
from springfoot.envs.biped import WINDOWS, Biped, Tick
from springfoot.envs.settings import BipedSettings
from springfoot.envs.simulation import STEPS_PER_WINDOW

STEPS, WARM_UP = 200, 20


def step_over_physics(num: int) -> tuple[np.ndarray, np.ndarray, float]:
    """CPU time [s] of each full step and of its physics alone, (STEPS,); largest joint-angle difference [rad]."""
    biped = Biped(BipedSettings(), num)
    ticks: list[Tick] = []
    biped.on_tick = ticks.append
    biped.reset(np.arange(num), range(num))
    model = biped.model
    raw = [biped.data(index) for index in range(num)]
    full, physics = np.empty((2, STEPS + WARM_UP))
    for step in range(STEPS + WARM_UP):
        action = action_of(biped.scheduled_stiffness(), biped.settings, biped.body).reshape(num, -1)
        ticks.clear()
        begin = time.process_time()
        outcome = biped.step(action)
        full[step] = time.process_time() - begin
        assert not outcome.terminated.any(), "the bench measures walking"
        physics[step] = 0.0
        for tick in ticks:
            controls = np.stack([tick.stiffness, tick.stiffness * tick.equilibrium], -1).reshape(num, -1)
            for data, control in zip(raw, controls, strict=True):
                data.ctrl[:] = control
            begin = time.process_time()
            for data in raw:
                mujoco.mj_step(model, data, STEPS_PER_WINDOW)
            physics[step] += time.process_time() - begin
    apart = max(np.abs(raw[i].qpos[3:] - ticks[-1].measurement.angle[i].ravel()).max() for i in range(num))
    return full[WARM_UP:], physics[WARM_UP:], apart


def main() -> None:
    """Print the ratios."""
    print(f"full step of {WINDOWS} x {STEPS_PER_WINDOW} physics steps over mj_step alone, CPU time, {STEPS} pairs")
    for num in (64, 8, 1):
        full, physics, apart = step_over_physics(num)
        low, median, high = np.percentile(full / physics, (25, 50, 75))
        print(
            f"N = {num:2d}: ratio {median:.3f} (quartiles {low:.3f} to {high:.3f}); "
            f"{1e6 * np.median(physics) / num:.0f} us of physics per body and step; same walk within {apart:.0e} rad"
        )


if __name__ == "__main__":
    main()
