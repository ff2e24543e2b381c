"""Extreme steps: actions at their ends, in settings, feet and worlds drawn from all that is accepted.

    python -m benchmarks.extreme_steps --steps 10000000

Every observation must be of its space, every reward and every number of the info finite, and the memory flat once the
tables of speeds and bodies, of which the last few hundred are kept, are full. The tests do it with
`--steps 50000 --settings 6`: six settings, each walked three times, so that the later times nothing is new.
"""

import ctypes
import gc
import sys
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import tyro
from tqdm import tqdm

from springfoot.command_line import exit_code
from springfoot.envs import SegmentedFootBipedVector
from springfoot.envs.settings.feet import KINDS
from springfoot.errors import SpringfootError, require_count

ENVIRONMENTS, STEPS = 32, 1000
"""Environments side by side, and steps of each, in one setting."""
TIMES = 3
"""How often each of a given number of settings is walked; the first time is the warm-up."""
WARM_UP = 0.3
"""Share of the steps after which the memory must be flat."""


@dataclass(kw_only=True)
class Found:
    """Numbers seen in the steps."""

    steps: int = 0
    settings: int = 0
    falls: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    """Why drawn settings were refused."""
    wrong: list[str] = field(default_factory=list)
    """Values not finite or not in their space, each with its setting."""
    memory: list[float] = field(default_factory=list)
    """Resident memory after each setting [MB]."""
    warm: int = 0
    """Settings after which it must be flat."""
    window: int = 1
    """Settings over which it is averaged then, and at the end."""

    @property
    def growth(self) -> float:
        """Memory at the end over that after the warm-up, less one."""
        rows = self.memory[self.warm :]
        return float(np.mean(rows[-self.window :]) / np.mean(rows[: self.window]) - 1)


def drawn_settings(random: np.random.Generator) -> dict[str, Any]:
    """Draw settings from anywhere in their ranges, often at their ends; some are refused."""

    def within(low: float, high: float) -> float:
        return float(random.choice([low, high, random.uniform(low, high)]))

    def pair(low: float, high: float) -> tuple[float, float]:
        one, other = sorted(random.uniform(low, high, 2))
        return float(random.choice([low, one])), float(random.choice([high, other]))

    def one_of(*values: Any) -> Any:
        return values[random.integers(len(values))]

    def maybe(value: Any) -> Any:
        return value if random.random() < 0.3 else None

    settings: dict[str, Any] = {
        "height": within(1.0, 2.3),
        "speed": within(0.4, 2.0),
        "leg_ratio": within(0.94, 1.06),
        "carried_ratio": one_of(0.0, within(0.0, 0.4)),
        "left_foot": one_of("intact", *KINDS),
        "right_foot": one_of("intact", *KINDS),
        "cadence": one_of("people", "people", "thesis"),
        "equilibrium": one_of("planned", "angle", "neutral"),
        "feedforward": one_of("people", "plan"),
        "action_mode": one_of("absolute", "residual"),
        "decisions": one_of("100hz", "50hz", "25hz", "event"),
        "stiffness_joints": one_of("both", "ankle", "toe"),
        "ankle_stiffness_range": one_of((20.0, 800.0), (1e-3, 1e5), (1e-3, 2e-3), (9e4, 1e5)),
        "toe_stiffness_range": one_of((5.0, 200.0), (1e-3, 1e5), (1e-3, 2e-3), (9e4, 1e5)),
        "episode_seconds": one_of(0.05, 5.0, 20.0, 1e9),
        "start": one_of("random", "standing", within(0.0, 0.999)),
        "stop_at": maybe(within(3.0, 6.0)),
        "start_noise": one_of(0.0, within(0.0, 1.0)),
        "push_newton": one_of(0.0, within(0.0, 1e5)),
        "push_seconds": 0.01,
        "push_interval": within(0.01, 4.0),
        "friction": within(0.4, 1.2),
        "slope_deg": within(-5.0, 5.0),
        "slope_range_deg": maybe((-5.0, 5.0)),
        "unevenness_m": within(0.0, 0.03),
        "sensor_noise": within(0.0, 0.1),
        "stiffness_delay_s": one_of(0.0, 0.01, 0.04),
        "height_range": maybe(pair(1.0, 2.3)),
        "mass_range": maybe(pair(20.0, 250.0)),
        "reward_weights": one_of({}, {"alive": 1e6, "grf": 1e6, "stiffness": -1e6, "effort": -1e6}),
    }
    settings["mass"] = float(np.clip(settings["height"] ** 2 * within(13.0, 50.0), 20.0, 250.0))
    if settings["cadence"] == "people":
        settings["step_time_ratio"] = one_of(1.0, within(0.8, 1.2))
    if (speeds := maybe(pair(0.4, 2.0))) is not None:
        settings |= {"speed_range": speeds, "speed_interval": one_of(0.04, 2.0), "speed_rate": one_of(0.01, 1e9)}
    return settings


def walk(settings: dict[str, Any], seed: int, steps: int, found: Found) -> None:
    """Take so many steps in each of `ENVIRONMENTS` and add the numbers seen; `SpringfootError` for refused settings."""
    random = np.random.default_rng(seed)
    envs = SegmentedFootBipedVector(ENVIRONMENTS, **settings)
    space = envs.single_observation_space
    count = envs.single_action_space.shape
    assert count is not None
    observation, _ = envs.reset(seed=seed)
    for step in range(steps):
        if step % 50 == 0:  # then: anything, the other end in every step, now and then, or nothing
            kind = int(random.integers(4))
        ends = random.choice([-1.0, 1.0], (ENVIRONMENTS, *count))
        at_once = np.full(ends.shape, (-1.0) ** step)
        actions = (ends, at_once, at_once * (-1.0) ** (step // 25), 0.0 * ends)[kind]
        observation, reward, terminated, _, info = envs.step(actions.astype(np.float32))
        found.falls += int(terminated.sum())
        numbers = [values for values in info.values() if isinstance(values, np.ndarray) and values.dtype.kind == "f"]
        if not all(row in space for row in observation):
            found.wrong.append(f"observation in {settings}")
        if not np.isfinite(reward).all() or not all(np.isfinite(values).all() for values in numbers):
            found.wrong.append(f"reward or info in {settings}")
        if found.wrong:
            break
    found.steps += ENVIRONMENTS * steps
    envs.close()


def resident() -> float:
    """Return the memory of this process in use now, without memory freed and kept for later [MB]."""
    gc.collect()
    with suppress(OSError, AttributeError):  # another system's library
        ctypes.CDLL("libc.so.6").malloc_trim(0)
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * 4096 / 2**20


def extremes(steps: int, seed: int = 0, count: int = 0, progress: Any = lambda steps: None) -> Found:
    """Take `steps` extreme steps or a few more, in so many settings, three times in each, or, for 0, in ever new ones.

    Ends at the first number that is not finite.
    """
    found = Found()
    random = np.random.default_rng(seed)
    each = -(-steps // (TIMES * count * ENVIRONMENTS)) if count else STEPS
    accepted: list[tuple[dict[str, Any], int]] = []
    while found.steps < steps and not found.wrong:
        if count and len(accepted) == count:
            settings, own_seed = accepted[found.settings % count]
        else:
            settings = drawn_settings(random)
            own_seed = int(random.integers(2**31))
        before = found.steps
        try:
            walk(settings, own_seed, each, found)
        except SpringfootError as error:
            found.refused[str(error).split(",")[0][:60]] += 1
            continue
        if len(accepted) < count:
            accepted.append((settings, own_seed))
        found.settings += 1
        found.memory.append(resident())
        progress(found.steps - before)
    found.warm = count or round(WARM_UP * found.settings)
    found.window = count or max((found.settings - found.warm) // 3, 1)
    return found


@dataclass(frozen=True, kw_only=True)
class Flags:
    """Take extreme steps in drawn settings; everything must stay finite, and the memory flat."""

    steps: int = 10_000_000
    """Environment steps."""
    seed: int = 0
    """Of settings and actions."""
    settings: int = 0
    """Walk in so many settings, three times in each; 0 draws new ones all the time."""


def run(flags: Flags) -> int:
    """Take the steps, print the numbers seen; 1 if a number was not finite or the memory grew by 2 % or more."""
    require_count("steps", flags.steps)
    require_count("seed", flags.seed, 0)
    require_count("settings", flags.settings, 0)
    with tqdm(total=flags.steps, unit="step", unit_scale=True, disable=None) as bar:
        found = extremes(flags.steps, flags.seed, flags.settings, bar.update)
    print(f"{found.steps:,} steps in {found.settings} settings, {found.falls:,} falls")
    print(f"refused: {sum(found.refused.values())}: {dict(found.refused.most_common(5))}")
    print(f"not finite or not in its space: {found.wrong or 'nothing'}")
    print(
        f"memory: {found.memory[0]:.0f} MB at first, {found.memory[-1]:.0f} MB at the end, "
        f"{found.growth:+.2%} after the first {found.warm} settings"
    )
    return 1 if found.wrong or found.growth >= 0.02 else 0


if __name__ == "__main__":
    sys.exit(exit_code("extreme_steps", lambda: run(tyro.cli(Flags, prog="python -m benchmarks.extreme_steps"))))
