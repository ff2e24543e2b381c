"""Cheating: whether the true price of a walk falls as much as the reading of a learner that pays for it.

    python -m benchmarks.cheating

For each seed two trainings of one task, in which the policy moves the legs and sets the stiffness, one of them charged
for the work of its fibres (`fibre_work`). Of the walks of both are measured the reading, which is that term, and the
truth: the energy of every physics step with the muscles' smooth force. Both stand over the commanded way, over which a
slower walk is cheaper, whatever the price: so both trainings are charged for a speed that is not held, too. A learner
with a reading that hardly falls has not tried to cheat, and decides nothing. The old term `effort` is told beside.
"""

import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
import tyro
from numpy.typing import NDArray

from springfoot.agents.policies.baselines import PolicyFunction
from springfoot.agents.policies.policy import LAST
from springfoot.agents.training.config import PRESETS
from springfoot.agents.training.training import train
from springfoot.envs import Biped
from springfoot.envs.batch.step_result import Tick
from springfoot.envs.batch.walk import walked_steps
from springfoot.envs.physics.model import JOINTS, SIDES
from springfoot.envs.physics.muscles import leg_strengths
from springfoot.envs.physics.timing import PHYSICS_STEP, PHYSICS_STEPS_PER_WINDOW
from springfoot.envs.settings.settings import Acts
from springfoot.evaluation.recording.policies import policy_and_settings
from springfoot.evaluation.recording.recording import TICK
from springfoot.gait import GRAVITY
from springfoot.gait.body.tissue import passive_moments
from springfoot.gait.plan.effort import MuscleUse, muscle_use

STRICTEST = 1.05
"""Largest truth with the charge over that without, divided by the same of the reading; chosen."""
LEAST_FALL = 0.1
"""Smallest fall of the reading that decides; chosen: a truth that stayed would then stand 1.11 times too high."""


@dataclass(frozen=True, kw_only=True)
class Cheating:
    """Train with and without a charge for the fibres' work, and hold the reading's fall against the truth's."""

    seeds: tuple[int, ...] = (0, 1, 2)
    """Seeds of the trainings."""
    timesteps: int = 500_000
    """Steps of each training."""
    acts: Acts = "both"
    """Part that the policy acts on."""
    charge: float = -2.0
    """Weight of `fibre_work`."""
    held: float = -10.0
    """Weight of `speed_held`, in both trainings."""
    episodes: int = 10
    """Episodes walked by each learner."""
    seconds: float = 8.0
    """Length of an episode [s]; its second half counts."""
    threads: int = 0
    """Threads of the physics in the trainings, 0 for one per processor."""


def replayed(biped: Biped, act: PolicyFunction, windows: int) -> tuple[NDArray, NDArray, list[Tick], NDArray]:
    """Walk one body for a number of control windows, fewer if it falls, and its physics again step by step.

    Returns:
        torque of the actuators (T, side, joint) [N m] and angle (T + 1, side, joint) [rad] of every physics step, the
        ticks of the walk, and (2,) means of the reward's terms `fibre_work` and `effort` in its second half.
    """
    replay = biped.data(0)
    controls: list[NDArray] = []
    ticks: list[Tick] = []
    paid: list[list[float]] = []

    def keep(tick: Tick) -> None:
        ticks.append(tick)
        controls.append(biped.data(0).ctrl.copy())

    biped.on_tick = keep
    for _, step in walked_steps(biped, act, windows // biped.windows_per_step):
        paid.append([step.info[f"reward/{term}"][0] for term in ("fibre_work", "effort")])
    torque: list[NDArray] = []
    angle = [replay.qpos[3:].copy()]
    for control in controls:
        replay.ctrl[:] = control
        for _ in range(PHYSICS_STEPS_PER_WINDOW):
            mujoco.mj_step(biped.model, replay)
            torque.append(replay.qfrc_actuator[3:].copy())
            angle.append(replay.qpos[3:].copy())
    shape = -1, len(SIDES), len(JOINTS)
    return np.reshape(torque, shape), np.reshape(angle, shape), ticks, np.mean(paid[len(paid) // 2 :], 0)


def finely_used(biped: Biped, torque: NDArray, angle: NDArray, windows: int) -> MuscleUse:
    """Return the use of the muscles over every physics step of a walk from `replayed`, with a smooth force.

    Rest angles are held for 10 ms, so torques of single steps are saw teeth around the muscles' force: that force is
    the mean over each window, lines between the windows' middles.
    """
    turn = np.diff(angle, axis=0)
    fibres = -torque - passive_moments(biped.body, 0.5 * (angle[1:] + angle[:-1]))
    mean = fibres.reshape(windows, PHYSICS_STEPS_PER_WINDOW, *fibres.shape[1:]).mean(1)
    step = np.arange(len(fibres)) + 0.5
    window = PHYSICS_STEPS_PER_WINDOW * (np.arange(windows) + 0.5)
    smooth = np.stack([np.interp(step, window, curve) for curve in mean.reshape(windows, -1).T], -1)
    smooth = smooth.reshape(fibres.shape)
    half = -smooth * turn / 2
    strength = leg_strengths(biped.body, biped.settings.feet)
    return muscle_use(smooth, np.stack([half, half], -1), PHYSICS_STEP, strength, biped.body.strength_scale)


@dataclass(frozen=True, kw_only=True)
class Prices:
    """Costs of the fibres in a learner's walks over body weight and way, means over episodes."""

    reading: float
    """The reward's term, over the commanded way [-]."""
    effort: float
    """The term `effort`, likewise [-]."""
    truth: float
    """Energy of every physics step, over the commanded way [-]."""
    walked: float
    """The same over the walked way [-]."""
    speed: float
    """[m/s]"""
    falls: int
    """Episodes that ended in a fall; nothing of them counts."""


def prices(policy: Path, how: Cheating) -> Prices:
    """Measure the walks of a trained policy in the second half of each episode."""
    act, settings = policy_and_settings(str(policy), {"episode_seconds": how.seconds + 0.02})
    windows, found, falls = 2 * round(how.seconds / TICK / 2), [], 0
    for seed in range(how.episodes):
        biped = Biped(settings, 1)
        biped.reset(np.array([0]), [seed])
        torque, angle, ticks, terms = replayed(biped, act, windows)
        if len(ticks) < windows:
            falls += 1
            continue
        late = slice(windows // 2 * PHYSICS_STEPS_PER_WINDOW, None)
        energy = finely_used(biped, torque[late], angle[windows // 2 * PHYSICS_STEPS_PER_WINDOW :], windows // 2)
        commanded = settings.speed * how.seconds / 2
        way = ticks[-1].measurement.com[0, 0] - ticks[windows // 2].measurement.com[0, 0]
        weight = biped.body.mass * GRAVITY
        spent = energy.energy.sum() / weight
        found.append((*terms, spent / commanded, spent / way, way / (how.seconds / 2)))
    reading, effort, truth, walked, speed = np.mean(found, 0).tolist() if found else [np.nan] * 5
    return Prices(reading=reading, effort=effort, truth=truth, walked=walked, speed=speed, falls=falls)


def learned(how: Cheating, seed: int, charge: float) -> Prices:
    """Train, and measure the last policy."""
    preset = PRESETS["walk"]
    weights = {"speed_held": how.held, "fibre_work": charge}
    weights = dict(preset.environment.reward_weights) | weights
    task = replace(preset.environment, reward_weights=weights, acts=how.acts)
    with tempfile.TemporaryDirectory() as place:
        run = Path(place, "run")
        train(replace(preset, seed=seed, timesteps=how.timesteps, threads=how.threads, environment=task), run)
        return prices(run / LAST, how)


def main(how: Cheating) -> int:
    """Compare; 0 if in every seed the truth falls as the reading does, and that by `LEAST_FALL` or more, else 1."""
    kept = True
    for seed in how.seeds:
        free, charged = (learned(how, seed, charge) for charge in (0.0, how.charge))
        for words, price in (("free", free), ("charged", charged)):
            print(f"seed {seed}, {words}: {price}", flush=True)
        reading, effort, truth = (
            getattr(charged, name) / getattr(free, name) for name in ("reading", "effort", "truth")
        )
        print(f"seed {seed}: reading x {reading:.3f}, effort x {effort:.3f}, ratio {truth / reading:.3f}", flush=True)
        decides = reading <= 1.0 - LEAST_FALL and not free.falls and not charged.falls
        kept = kept and decides and truth / reading <= STRICTEST
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Cheating)))
