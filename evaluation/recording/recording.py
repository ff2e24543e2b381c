"""Record episodes of a policy as 100 Hz series, from which all numbers and pictures of an evaluation are computed."""

from collections.abc import Callable, Collection, Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, isfinite
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from springfoot.agents.policies.baselines import PolicyFunction
from springfoot.arrays import NDArray
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.batch.step_result import INFO, Tick
from springfoot.envs.batch.walk import Walked, walked_steps
from springfoot.envs.control.constants import LegConstants
from springfoot.envs.control.reference_walk import reference_walk_at
from springfoot.envs.control.standing import steady_walk
from springfoot.envs.control.stiffness_control import FEET
from springfoot.envs.control.subjects import DRAWN
from springfoot.envs.physics.contact import CONTACTS
from springfoot.envs.physics.energy import ledger_entries
from springfoot.envs.physics.foot import Feet
from springfoot.envs.physics.model import JOINTS, SIDES
from springfoot.envs.physics.simulation import MjModel
from springfoot.envs.settings.settings import (
    DRAWN_SETTINGS,
    BipedSettings,
    settings_from,
    settings_to_json,
)
from springfoot.envs.task.reward import TERMS
from springfoot.errors import SpringfootError
from springfoot.files.array_file import read_arrays, write_arrays
from springfoot.gait.people.gait_events import PERCENT
from springfoot.gait.people.gait_events import WARM_UP as WARM_UP
from springfoot.gait.plan.com_plan import ComPlan

TICK = Biped.tick_dt
"""Time between two samples [s]."""
LONGEST_RECORDING = 100_000
"""Longest recording, all episodes together [s]; chosen: its series have some 6 GB."""
BATCH = 32
"""Episodes simulated side by side."""

SERIES: dict[str, Callable[[Tick], NDArray]] = {
    "base": lambda tick: tick.measurement.base,  # (3,) hip x [m], hip z [m], trunk pitch [rad]
    "angle": lambda tick: tick.measurement.angle,  # (side, joint) [rad]
    "velocity": lambda tick: tick.measurement.velocity,  # (side, joint) [rad/s]
    "torque": lambda tick: tick.measurement.torque,  # (side, joint) actuator torque [N m]
    "joint_torque": lambda tick: tick.work.torque,  # (side, joint) actuator + joint damping, mean of the tick [N m]
    "joint_work": lambda tick: tick.work.work,  # (side, joint, (positive, negative)) work of it in the tick [J]
    "fibre_moment": lambda tick: tick.fibre_moment,  # (side, joint) of the muscles' fibres, mean of the tick [N m]
    "muscle_work": lambda tick: tick.muscle_work,  # (side, joint, half) of fibres and tendon in halves of the tick [J]
    "energy": lambda tick: tick.work.energy.view(float).reshape(len(tick.active), -1),  # (LEDGER,) [J]
    "com": lambda tick: tick.measurement.com,  # (x, z) [m]
    "com_velocity": lambda tick: tick.measurement.com_velocity,  # (x, z) [m/s]
    "com_reference": lambda tick: tick.com_reference,  # (x, z) where the plan wants it now [m]
    "ankle": lambda tick: tick.measurement.ankle,  # (side, (x, z)) ankle axes [m]
    "contact": lambda tick: tick.measurement.contact,  # (side, contact, (x, z)) lowest points [m]
    "force": lambda tick: tick.measurement.force,  # (side, contact, (forward, up)) mean of the tick [N]
    "phase": lambda tick: tick.phase,  # (side,) of the leg controller [0, 1)
    "stiffness": lambda tick: tick.stiffness[..., FEET],  # (side, (ankle, toe)) [N m/rad]
    "equilibrium": lambda tick: tick.equilibrium[..., FEET],  # (side, (ankle, toe)) [rad]
}
"""Name of a series -> function that takes its values from a tick.

Joint signs: flexion, dorsiflexion, toe-up positive; orders as in `envs.physics.model`.
"""
REWARD = "reward"
"""Series (TERMS,) of the reward's unweighted terms, in the step around each tick; a `Tick` itself does not have
them."""
_TERMS = slice(INFO.index(f"reward/{TERMS[0]}"), INFO.index(f"reward/{TERMS[-1]}") + 1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Recording:
    """E episodes of up to T ticks of 10 ms.

    Sample k holds states at the end of its tick, (k + 1) * 10 ms, and forces averaged over the tick.
    """

    policy: str
    """Name of the policy."""
    settings: BipedSettings
    """Settings of its environment."""
    seed: int
    """Episode i was seeded with seed + i."""
    ticks: NDArray
    """(E,) samples of each episode; series hold NaN beyond."""
    returns: NDArray
    """(E,) sum of the reward over each episode."""
    fall_reason: NDArray
    """(E,) reason of a fall, "" for an episode without one."""
    plan_com: NDArray
    """(101, 2) planned CoM over percent of the step: x from the ankle of the foot that began its stance last, z [m]."""
    plan_zmp: NDArray
    """(101,) planned ZMP over percent of the step, x from the same ankle [m]."""
    series: dict[str, NDArray]
    """Name -> (E, T, ...) float32, as listed in `SERIES`, and `REWARD`."""

    @property
    def example(self) -> int:
        """Return the episode for pictures and exports: the first without a fall, else the longest."""
        standing = np.flatnonzero(self.fall_reason == "")
        return int(standing[0]) if len(standing) else int(np.argmax(self.ticks))

    @property
    def measured_span(self) -> tuple[float, float]:
        """Return begin and end [s] of the walk that is measured: the steady one, without its first `WARM_UP` seconds;
        an end of infinity where the body does not stop."""
        begin, end = steady_walk(self.settings)
        return begin + WARM_UP, end

    @property
    def measured_ticks(self) -> slice:
        """Return the ticks of `measured_span`."""
        begin, end = self.measured_span
        return slice(round(begin / TICK), round(end / TICK) if isfinite(end) else None)

    def episode(self, index: int) -> dict[str, NDArray]:
        """Return name -> (T, ...) float64 series of one episode, its T samples before its end."""
        return {name: values[index, : self.ticks[index]].astype(float) for name, values in self.series.items()}

    def of_episode(self, index: int) -> "Recording":
        """Return the recording of one episode alone, with its seed."""
        alone = slice(index, index + 1)
        return replace(
            self,
            seed=self.seed + index,
            ticks=self.ticks[alone],
            returns=self.returns[alone],
            fall_reason=self.fall_reason[alone],
            series={name: values[alone] for name, values in self.series.items()},
        )

    def shown(self) -> dict[str, NDArray]:
        """Return the series of the episode `example` (`episode`)."""
        return self.episode(self.example)

    def save(self, path: Path) -> None:
        """Write the recording as `strides.npz`: its arrays, and all else as a header of JSON text, without pickles."""
        header = {
            "policy": self.policy,
            "settings": settings_to_json(self.settings),
            "seed": self.seed,
            "tick_s": TICK,
            "axes": {"side": SIDES, "joint": JOINTS, "contact": CONTACTS, "energy": ledger_entries(), "term": TERMS},
        }
        arrays: dict[str, Any] = {
            name: getattr(self, name) for name in ("ticks", "returns", "fall_reason", "plan_com", "plan_zmp")
        }
        write_arrays(path, header, arrays | self.series)


def load_recording(path: str | Path) -> Recording:
    """Return the recording in a `strides.npz`.

    Raises `SpringfootError` for any other file, and for a recording of another version.
    """
    header, arrays = read_arrays(Path(path), "strides.npz written by evaluate.py")
    try:
        if missing := [name for name in ("plan_zmp", *SERIES, REWARD) if name not in arrays]:
            raise SpringfootError(f"it has no {missing[0]}: another version of springfoot wrote it; evaluate again")
        series = {name: arrays.pop(name) for name in (*SERIES, REWARD)}
        settings = settings_from(**header["settings"])
        recording = Recording(policy=header["policy"], seed=header["seed"], settings=settings, series=series, **arrays)
        _require_whole(recording)
        return recording
    except (SpringfootError, KeyError, TypeError) as error:
        raise SpringfootError(f"{path}: {error}") from None


def _require_whole(recording: Recording) -> None:
    """Raise `SpringfootError` if the arrays of a file's recording disagree on the number of episodes or ticks."""
    episodes, length = recording.series["phase"].shape[:2]
    for name in ("ticks", "returns", "fall_reason"):
        if getattr(recording, name).shape != (episodes,):
            raise SpringfootError(f"{name} must be ({episodes},), is {getattr(recording, name).shape}")
    for name, values in recording.series.items():
        if values.shape[:2] != (episodes, length) or values.dtype != np.float32:
            raise SpringfootError(f"{name} must be float32 ({episodes}, {length}, ...), is {values.shape}")
    if recording.ticks.dtype.kind != "i" or not ((recording.ticks > 0) & (recording.ticks <= length)).all():
        raise SpringfootError(f"ticks must be whole numbers in [1, {length}]")


def require_recordable(settings: BipedSettings, episodes: int) -> None:
    """Raise `SpringfootError` for episodes with series that would fill the memory."""
    if episodes * settings.episode_seconds > LONGEST_RECORDING:
        raise SpringfootError(
            f"a recording must be of at most {LONGEST_RECORDING:,} s in all, got {episodes} episodes of "
            f"{settings.episode_seconds:g} s"
        )


def record(
    policy: PolicyFunction,
    settings: BipedSettings,
    *,
    name: str,
    episodes: int = 20,
    seed: int = 0,
    threads: int = 2,
    model: MjModel | None = None,
    legs: LegConstants | None = None,
    progress: Callable[[float], object] = lambda seconds: None,
) -> Recording:
    """Record `episodes` episodes of `settings.episode_seconds` each, episode i from seed `seed` + i.

    Args:
        policy: deterministic function of observations (N, D) that returns actions (N, A).
        settings: of the environment.
        name: of the policy, in reports.
        episodes: number of episodes.
        seed: of the first episode.
        threads: of the physics; any number gives the same bits.
        model: compiled model with other physics options, in place of the settings' one.
        legs: leg constants in place of the committed ones.
        progress: called after every step with the seconds that it simulated, all episodes together.

    Raises `SpringfootError` for settings that draw body, speed or world anew for each episode.
    """
    if any(getattr(settings, name) is not None for name in DRAWN_SETTINGS):
        raise SpringfootError(
            f"a recording is of one body at one speed in one world: {', '.join(DRAWN_SETTINGS)} must be None"
        )
    seeds = range(seed, seed + episodes)
    kept = record_all(policy, settings, seeds, threads=threads, model=model, legs=legs, progress=progress)
    course: dict[str, Any] = planned_course(reference_walk_at(settings, settings.speed).plan)
    return Recording(policy=name, settings=settings, seed=seed, **kept.of(slice(None)), **course)


def record_each(
    policy: PolicyFunction,
    settings: BipedSettings,
    walkers: Mapping[str, ArrayLike],
    *,
    name: str,
    seed: int = 0,
    threads: int = 2,
    progress: Callable[[float], object] = lambda seconds: None,
) -> list[Recording]:
    """Record, as `record` does, one episode for each of E bodies and speeds, episode i from seed `seed` + i.

    Returns a recording for each, with the settings of its body and speed. `walkers` holds `height` [m], `mass` [kg] and
    `speed` [m/s], (E,) each, within the ranges that the `settings` draw from. Raises `SpringfootError` for a
    commanded speed that changes within an episode.
    """
    if settings.speed_interval is not None:
        raise SpringfootError(
            f"a recording is at one speed: speed_interval must be None, got {settings.speed_interval}"
        )
    columns = np.broadcast_arrays(*(np.asarray(walkers[key], float) for key in DRAWN))
    drawn = dict(zip(DRAWN, columns, strict=True))
    episodes = len(columns[0])
    seeds = range(seed, seed + episodes)
    kept = record_all(policy, settings, seeds, given=drawn, threads=threads, progress=progress)
    recordings = []
    for index in range(episodes):
        body_and_speed = {key: float(values[index]) for key, values in drawn.items()} | dict.fromkeys(DRAWN_SETTINGS)
        of_episode = replace(settings, **body_and_speed)
        course: dict[str, Any] = planned_course(reference_walk_at(of_episode, of_episode.speed).plan)
        rows = slice(index, index + 1)
        recordings.append(Recording(policy=name, settings=of_episode, seed=seed + index, **kept.of(rows), **course))
    return recordings


def record_feet(
    policy: PolicyFunction,
    settings: BipedSettings,
    feet: Sequence[Mapping[str, Any]],
    *,
    name: str,
    episodes: int = 20,
    seed: int = 0,
    threads: int = 2,
    progress: Callable[[float], object] = lambda seconds: None,
) -> list[Recording]:
    """Record, as `record` does, the same episodes on all `feet`, side by side.

    `feet` are settings of one foot or both, such as `{"right_foot": "passive"}`. Returns a recording for each. Episode
    i on each of them is from seed `seed` + i.
    """
    settings_by_feet = [replace(settings, **foot_settings) for foot_settings in feet]
    # One walk after another: all episodes on the first feet, then all on the next.
    feet_of_episodes = [on_feet.feet for on_feet in settings_by_feet for _ in range(episodes)]
    seeds = [seed + episode for _ in settings_by_feet for episode in range(episodes)]
    course: dict[str, Any] = planned_course(reference_walk_at(settings, settings.speed).plan)
    kept = record_all(policy, settings, seeds, threads=threads, feet=feet_of_episodes, progress=progress)
    recordings = []
    for index, on_feet in enumerate(settings_by_feet):
        rows = slice(index * episodes, (index + 1) * episodes)
        recordings.append(Recording(policy=name, settings=on_feet, seed=seed, **kept.of(rows), **course))
    return recordings


def record_policies(
    policies: Mapping[str, PolicyFunction],
    settings: BipedSettings,
    *,
    episodes: int = 20,
    seed: int = 0,
    threads: int = 2,
    progress: Callable[[float], object] = lambda seconds: None,
) -> list[Recording]:
    """Record, as `record` does, the same episodes with each of several `policies`, by name, side by side.

    Returns a recording for each. The policies must decide on each environment by itself, whatever stands beside it.
    """
    course: dict[str, Any] = planned_course(reference_walk_at(settings, settings.speed).plan)
    seeds = range(seed, seed + episodes)
    names = list(policies)
    together = max(1, BATCH // episodes)  # policies in a batch
    recordings = []
    for first in range(0, len(names), together):
        batch = names[first : first + together]
        act = _join_policies([policies[name] for name in batch])
        kept = record_all(act, settings, [*seeds] * len(batch), threads=threads, progress=progress)
        for index, name in enumerate(batch):
            rows = slice(index * episodes, (index + 1) * episodes)
            recordings.append(Recording(policy=name, settings=settings, seed=seed, **kept.of(rows), **course))
    return recordings


def _join_policies(policies: Sequence[PolicyFunction]) -> PolicyFunction:
    """Return one policy for a batch that several policies walk in side by side.

    The first of P policies acts in the first N / P of the N environments, and so on; all act as they do alone.
    """
    if len(policies) == 1:
        return policies[0]

    def act(observation: NDArray) -> NDArray:
        """Return the actions (N, A) for observations (N, D), each policy's on its rows."""
        parts = np.split(observation, len(policies))
        return np.concatenate([policy(part) for policy, part in zip(policies, parts, strict=True)])

    return act


@dataclass(frozen=True, kw_only=True, eq=False)
class Episodes:
    """Room for E episodes while they are walked; fields as in a `Recording`."""

    ticks: NDArray
    """(E,) samples of each episode so far."""
    returns: NDArray
    """(E,) sum of the reward so far."""
    fall_reason: NDArray
    """(E,) reason of a fall, "" without one."""
    series: dict[str, NDArray]
    """Name -> (E, length, ...) float32, NaN beyond an episode's samples; those of `SERIES` appear with the first
    tick."""
    length: int
    """Most ticks of an episode."""
    names: Collection[str] = tuple(SERIES)
    """Names of the series that are kept."""

    @classmethod
    def empty(cls, count: int, length: int, names: Collection[str] = tuple(SERIES)) -> "Episodes":
        """Return room for `count` episodes of at most `length` ticks: for their reward, and the series `names`."""
        return cls(
            ticks=np.zeros(count, int),
            returns=np.zeros(count),
            fall_reason=np.full(count, "", dtype="U64"),
            series={REWARD: np.full((count, length, len(TERMS)), np.nan, np.float32)},
            length=length,
            names=names,
        )

    @classmethod
    def of_length(cls, settings: BipedSettings, count: int) -> "Episodes":
        """Return room for `count` episodes of the settings' length. Raises as `require_recordable`."""
        require_recordable(settings, count)
        step = settings.step_seconds
        steps = ceil(round(settings.episode_seconds / step, 6))  # rounded first: 2.0000000001 steps are 2
        return cls.empty(count, round(step / TICK) * steps)

    def of(self, rows: slice) -> dict[str, Any]:
        """Return name -> value of those fields of a `Recording` that have an axis of episodes, for the episodes `rows`
        alone."""
        return {
            "ticks": self.ticks[rows],
            "returns": self.returns[rows],
            "fall_reason": self.fall_reason[rows],
            "series": {name: values[rows] for name, values in self.series.items()},
        }

    def episode(self, index: int) -> dict[str, NDArray]:
        """Return name -> (T, ...) float64 series of one episode, without the samples after its end."""
        return {name: values[index, : self.ticks[index]].astype(float) for name, values in self.series.items()}


def recorded_steps(
    biped: Biped,
    act: PolicyFunction,
    kept: Episodes,
    rows: slice = slice(None),
    steps: int | None = None,
    on_tick: Callable[[Tick], object] = lambda tick: None,
) -> Generator[Walked, None, None]:
    """Walk one episode in each environment of a batch, write every tick into the series of `kept`, and yield after each
    step.

    All measurements of walks start from these series.

    Args:
        biped: batch that has just been reset.
        act: policy, a function of observations (N, D) that returns actions (N, A).
        kept: room for episodes, which is filled.
        rows: episodes of `kept` that are walked, one for each environment.
        steps: most steps to walk; None for episodes of the settings' length.
        on_tick: called after every tick, once it is written.
    """
    ticks = kept.ticks[rows]

    def keep(tick: Tick) -> None:
        """Write the tick's values into the series, which the first tick creates; NaN for episodes that have ended."""
        index = int(ticks.max())  # episodes begin together: the longest one has no gap
        for name in kept.names:
            value = SERIES[name](tick)
            if name not in kept.series:
                kept.series[name] = np.full((len(kept.ticks), kept.length, *value.shape[1:]), np.nan, np.float32)
            walking = tick.active.reshape(-1, *[1] * (value.ndim - 1))  # (N, 1, ...), as the value
            kept.series[name][rows, index] = np.where(walking, value, np.nan)
        ticks[:] += tick.active
        on_tick(tick)

    biped.on_tick = keep
    first = 0  # tick at which the step begins; `last` is that of the next step
    try:
        for walked in walked_steps(biped, act, steps):
            active, result = walked
            last = int(ticks.max())
            kept.series[REWARD][rows, first:last][active] = result.values[active, None, _TERMS]
            kept.returns[rows][active] += result.reward[active]
            fell = active & result.terminated
            kept.fall_reason[rows][fell] = result.reasons[fell]
            first = last
            yield walked
    finally:  # also where the caller leaves early
        biped.on_tick = None


def record_walk(
    biped: Biped,
    act: PolicyFunction,
    kept: Episodes,
    rows: slice = slice(None),
    steps: int | None = None,
    progress: Callable[[float], object] = lambda seconds: None,
) -> None:
    """Walk the episodes of `recorded_steps` to their end; call `progress` after every step with the seconds that it
    simulated."""
    for active, _ in recorded_steps(biped, act, kept, rows, steps):
        progress(float(active.sum()) * biped.dt)


def record_all(
    policy: PolicyFunction,
    settings: BipedSettings,
    seeds: Sequence[int],
    *,
    given: Mapping[str, NDArray] = MappingProxyType({}),
    threads: int = 2,
    model: MjModel | None = None,
    legs: LegConstants | None = None,
    feet: Sequence[Feet] | None = None,
    progress: Callable[[float], object] = lambda seconds: None,
) -> Episodes:
    """Walk one episode for each of E `seeds`, `BATCH` of them side by side; return their series.

    Args:
        policy: function of observations (N, D) that returns actions (N, A).
        settings: of the environment.
        seeds: (E,) seed of each episode.
        given: name -> (E,) `height`, `mass` or `speed` of each episode, where the settings draw them.
        threads, model, legs, progress: as in `record`.
        feet: (E,) feet of each episode; None for those of the settings.
    """
    kept = Episodes.of_length(settings, len(seeds))
    for first in range(0, len(seeds), BATCH):
        rows = slice(first, min(first + BATCH, len(seeds)))
        count = rows.stop - first
        batch_feet = feet and feet[rows]
        biped = Biped(settings, num_envs=count, num_threads=threads, model=model, legs=legs and [legs], feet=batch_feet)
        biped.reset(np.arange(count), list(seeds[rows]), given={k: v[rows] for k, v in given.items()})
        record_walk(biped, policy, kept, rows, progress=progress)
    return kept


def planned_course(plan: ComPlan) -> dict[str, NDArray]:
    """Return `plan_com` (101, 2) and `plan_zmp` (101,) of a `Recording` [m]: the plan's CoM and ZMP over percent of the
    step."""
    # Percent 100 is the end of this step, not the beginning of the next.
    step_phase = np.minimum(PERCENT / 100, 1 - 1e-9)
    return {"plan_com": np.stack(plan.com(step_phase), -1), "plan_zmp": plan.zmp(step_phase)}
