"""Tally the 100 Hz series of a recording: curves over the stride, and one value for each stride, step and episode.

Human-facing edge: angles in degrees, forces in body weights (BW), moments in N m/kg, work in J/kg.
"""

from dataclasses import dataclass, field

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.physics.contact import CONTACTS
from springfoot.envs.physics.energy import ledger_entries
from springfoot.envs.physics.model import SIDES, contact_material
from springfoot.envs.settings.settings import BipedSettings, body_of
from springfoot.envs.task.reward import TERMS
from springfoot.gait import GRAVITY
from springfoot.gait.people import scores as score
from springfoot.gait.people.gait_events import CONTACT_THRESHOLD_BW, Contacts, find_steps, next_after, on_percent
from springfoot.gait.plan.effort import AS_IS, Muscle

from ..recording.recording import REWARD, TICK, Recording
from .curves import StrideCurves
from .measured_effort import EpisodeEffort, episode_effort
from .series import (
    GAIT_CYCLE_COLUMNS,
    distance_walked,
    foot_contacts,
    mean_speed,
    mid_tick,
    stride_curves,
    strides_within,
)

SHORTEST_SPEED = 1.0
"""Least time after the warm-up for which the speed of an episode counts [s]."""
CLEARANCE_SWING = (0.25, 0.75)
"""Part of the swing over which toe clearance is measured [fraction of the swing]."""


@dataclass(kw_only=True, eq=False)
class StrideTally:
    """Curves and values collected stride by stride, step by step and episode by episode."""

    feet: tuple[StrideCurves, StrideCurves] = field(
        default_factory=lambda: (StrideCurves(names=GAIT_CYCLE_COLUMNS), StrideCurves(names=GAIT_CYCLE_COLUMNS))
    )
    """Curves over the stride of the left and the right foot."""
    both: StrideCurves = field(default_factory=lambda: StrideCurves(names=GAIT_CYCLE_COLUMNS))
    """Curves over the stride of both feet."""
    com: StrideCurves = field(default_factory=lambda: StrideCurves(names=("x", "z", "vx")))
    """CoM over the step: x from the ankle of the foot that began its stance last, z above the ground [m], vx [m/s]."""
    cop: StrideCurves = field(default_factory=lambda: StrideCurves(names=("x",)))
    """CoP of both feet over the step, x from the same ankle [m]."""
    reward: StrideCurves = field(default_factory=lambda: StrideCurves(names=TERMS))
    """The reward's terms over the step, unweighted [-]."""
    strides_of_falls: int = 0
    """Strides of episodes that ended in a fall."""
    at_rest: int = 0
    """Episodes that ended standing still."""
    speed: list[float] = field(default_factory=list)
    """Mean forward speed of each episode [m/s]."""
    distance: float = 0.0
    """Distance walked in all episodes together [m]."""
    work: float = 0.0
    """Positive work of all joints in all episodes together [J]."""
    step_length: list[float] = field(default_factory=list)
    """Length of each step [m]."""
    step_time: list[float] = field(default_factory=list)
    """Duration of each step [s]."""
    double_support: list[float] = field(default_factory=list)
    """Double support at the start of each step [s]."""
    step_sides: list[int] = field(default_factory=list)
    """Foot that makes each step: 0 the left one swings and lands at the step's end, 1 the right one."""
    stride_sides: list[int] = field(default_factory=list)
    """Leg of each stride, 0 left, 1 right."""
    stride_time: list[float] = field(default_factory=list)
    """Duration of each stride [s]."""
    toe_off: list[float] = field(default_factory=list)
    """Toe-off of each stride [%]."""
    vertical_max: list[float] = field(default_factory=list)
    """Largest vertical force of each stride [BW]."""
    joint_work: list[NDArray] = field(default_factory=list)
    """(joint, 2) positive and negative work of one leg in each of its strides [J/kg]."""
    energy: list[NDArray] = field(default_factory=list)
    """Change of each entry of the body's ledger (`springfoot.envs.physics.energy`) in each stride [J/kg]."""
    effort: list[EpisodeEffort] = field(default_factory=list)
    """Use of the muscles in each episode of at least 3 steady ticks."""
    push_off: list[float] = field(default_factory=list)
    """Positive work of the trailing leg's force on the CoM in the double support of each step [J/kg]."""
    collision: list[float] = field(default_factory=list)
    """Negative work of the leading leg's force likewise, a positive number [J/kg]."""
    travel: list[float] = field(default_factory=list)
    """Distance the loaded sole slides in each stance [m]."""
    clearance: list[float] = field(default_factory=list)
    """Least height of ball and toe in the middle of each swing [m]."""

    @property
    def unsteady(self) -> float:
        """Return the standard deviation of the vertical force over the strides of both feet, root mean square over the
        stride [body weights]."""
        return float(np.sqrt(np.mean(self.both.sd("grf_vertical_bw") ** 2)))


def tally_strides(recording: Recording, muscle: Muscle = AS_IS) -> StrideTally:
    """Tally every stride, step and episode of a recording: its steady walk, without the warm-up.

    Whether an episode ends at rest is judged at its very end.
    `muscle` has factors on properties of the muscles with tallied effort.
    """
    tally = StrideTally()
    fell = recording.fall_reason != ""
    for episode, ticks in enumerate(recording.ticks):
        if ticks:
            series = recording.episode(episode)
            add_episode(tally, series, recording.settings, recording.measured_span, bool(fell[episode]), muscle)
            tally.at_rest += not fell[episode] and score.at_rest(
                series["com"], *series["ankle"].swapaxes(0, 1), tick=TICK
            )
    return tally


def add_episode(
    tally: StrideTally,
    series: dict[str, NDArray],
    settings: BipedSettings,
    steady: tuple[float, float],
    fell: bool = False,
    muscle: Muscle = AS_IS,
) -> None:
    """Add the strides and steps of one episode to a tally.

    Args:
        tally: to add to.
        series: name -> (T, ...), as in a recording.
        settings: of the environment: body, feet and slope.
        steady: from and to [s]; strides and steps outside this time do not count.
        fell: whether the episode ended in a fall.
        muscle: factors on properties of the muscles.
    """
    body = body_of(settings)
    weight = body.mass * GRAVITY  # [N]
    com = series["com"]
    # Distance, work and speed of the whole steady span, by ticks.
    first_tick, last_tick = (round(min(time / TICK, len(com))) for time in steady)
    if last_tick > first_tick:
        tally.distance += distance_walked(com, first_tick, last_tick)
        tally.work += float(series["joint_work"][first_tick:last_tick, ..., 0].sum())  # 0: the positive part
        if (last_tick - first_tick) * TICK >= SHORTEST_SPEED:
            tally.speed.append(mean_speed(com, first_tick, last_tick))
        if effort := episode_effort(series, body, settings.feet, first_tick, last_tick, muscle):
            tally.effort.append(effort)

    # Curves and numbers of each foot's strides, cut at its heel strikes.
    vertical = series["force"][..., 1].sum(axis=2)  # (T, side), all contacts of a foot together [N]
    contacts = foot_contacts(vertical, body)
    # How far the material of the sole at each contact point has moved: the slip of a loaded sole.
    material = contact_material(body, series["contact"], series["base"], series["angle"])
    for side, foot in enumerate(contacts):
        strides = strides_within(foot, steady)
        heel_strike, toe_off, next_heel_strike = strides.T
        curves = stride_curves(series, side, body, strides)
        tally.feet[side].add(curves)
        tally.both.add(curves)
        tally.strides_of_falls += fell * len(strides)
        tally.stride_sides += [side] * len(strides)
        tally.stride_time += list(next_heel_strike - heel_strike)
        tally.toe_off += list((toe_off - heel_strike) / (next_heel_strike - heel_strike) * 100)
        tally.joint_work += list(_sum_between(series["joint_work"][:, side], heel_strike, next_heel_strike) / body.mass)
        tally.energy += list(_stride_energies(series["energy"], heel_strike, next_heel_strike) / body.mass)
        contact = series["contact"][:, side]
        load = series["force"][:, side, :, 1]  # (T, contact), vertical [N]
        # Largest force, slip in stance and clearance in mid-swing of each stride, by ticks.
        for start, leave, stop in np.floor(strides / TICK).astype(int):
            tally.vertical_max.append(vertical[start : stop + 1, side].max() / weight)
            stance = slice(start, leave + 1)
            tally.travel.append(score.travel(material[stance, side], load[stance], CONTACT_THRESHOLD_BW * weight))
            first, last = (round(leave + part * (stop - leave)) for part in CLEARANCE_SWING)
            ball_and_toe = slice(CONTACTS.index("ball"), None)
            tally.clearance.append(contact[first : last + 1, ball_and_toe, 1].min())  # 1: height
    _add_steps(tally, series, contacts, settings, steady)


def _add_steps(
    tally: StrideTally,
    series: dict[str, NDArray],
    contacts: list[Contacts],
    settings: BipedSettings,
    steady: tuple[float, float],
) -> None:
    """Add the steps of one episode: CoM, CoP and reward over the step, lengths, times, double support and its work."""
    com_work = _com_work(series, settings) / body_of(settings).mass
    steps, sides = find_steps(contacts[0], contacts[1], after=steady[0])
    in_time = steps[:, 1] <= steady[1]
    steps = steps[in_time]
    sides = sides[in_time]
    for side in range(len(SIDES)):  # that of the foot that lands as the step begins; the other foot ends the step
        begin, end = steps[sides == side].T
        relative = np.column_stack(
            [series["com"][:, 0] - series["ankle"][:, side, 0], series["com"][:, 1], series["com_velocity"][:, 0]]
        )
        tally.com.add(on_percent(relative, begin, end, TICK, first=TICK))
        cop = _centre_of_pressure(series) - mid_tick(series["ankle"][:, side, 0])
        tally.cop.add(on_percent(cop[:, None], begin, end, TICK, first=TICK / 2))
        tally.reward.add(on_percent(series[REWARD], begin, end, TICK, first=TICK))
        # Step length: x of the other foot, which lands at the step's end, less x of this foot at the step's start.
        begin_tick, end_tick = np.floor(np.stack([begin, end]) / TICK).astype(int)
        ankle_x = series["ankle"][..., 0]
        tally.step_length += list(ankle_x[end_tick, 1 - side] - ankle_x[begin_tick, side])
        tally.step_time += list(end - begin)
        tally.step_sides += [1 - side] * len(begin)
        # The trailing foot leaves the ground within this step; without such a toe-off the body was in flight.
        both_on_ground = next_after(contacts[1 - side].toe_offs, begin) - begin  # [s]
        both_on_ground = np.where(both_on_ground < end - begin, both_on_ground, 0.0)
        tally.double_support += list(both_on_ground)
        work = _sum_between(com_work, begin, begin + both_on_ground)  # (step, side, (positive, negative))
        tally.push_off += list(work[:, 1 - side, 0])
        tally.collision += list(-work[:, side, 1])


def _com_work(series: dict[str, NDArray], settings: BipedSettings) -> NDArray:
    """Return the work of each leg's ground force on the CoM in each tick, (T, side, (positive, negative)) [J].

    It is the individual limbs' work of Donelan, Kram & Kuo, J. Biomech. 35 (2002) 117-124.
    """
    velocity = mid_tick(series["com_velocity"])
    # Recorded heights, and so upward velocities, are above the mean ground; work needs them in the world.
    velocity[:, 1] += np.tan(np.radians(settings.slope_deg)) * velocity[:, 0]
    work = (series["force"].sum(2) * velocity[:, None]).sum(-1) * TICK  # (T, side): force times way
    return np.stack([np.maximum(work, 0.0), np.minimum(work, 0.0)], -1)


def _sum_between(per_tick: NDArray, begin: NDArray, end: NDArray) -> NDArray:
    """Sum values per tick (T, ...) over S spans of time, from `begin` to `end` (S,) [s]; return (S, ...).

    A tick that an end of a span cuts counts by the fraction of it that lies within the span.
    """
    # Row k is the sum of the ticks before tick k.
    sum_before = np.concatenate([np.zeros((1, *per_tick.shape[1:])), np.cumsum(per_tick, axis=0)])

    def sum_until(time: NDArray) -> NDArray:
        """Return the sum from the start to the times (S,) [s], (S, ...)."""
        ticks = time / TICK
        whole_ticks = np.minimum(ticks.astype(int), len(per_tick) - 1)  # the last tick has a fraction of 1 at its end
        fraction = (ticks - whole_ticks).reshape(-1, *[1] * (sum_before.ndim - 1))  # (S, 1, ...), as the sums
        return sum_before[whole_ticks] + fraction * (sum_before[whole_ticks + 1] - sum_before[whole_ticks])

    return sum_until(end) - sum_until(begin)


def _stride_energies(energy: NDArray, begin: NDArray, end: NDArray) -> NDArray:
    """Return each stride's energy ledger (S, entries) [J]: works, and the rise of mechanical energy.

    `energy` (T, entries) is the ledger of each tick, with the mechanical energy at its end; strides last from `begin`
    to `end` (S,) [s].
    """
    flow = energy.copy()
    mechanical = ledger_entries().index("mechanical")
    flow[1:, mechanical] = np.diff(energy[:, mechanical])  # the first tick's change is unknown; no stride is in it
    return _sum_between(flow, begin, end)


def _centre_of_pressure(series: dict[str, NDArray]) -> NDArray:
    """Return (T,) the forward CoP of both feet at the middle of each tick [m]; NaN in flight."""
    load = series["force"][..., 1]  # (T, side, contact), vertical [N]
    forward = mid_tick(series["contact"][..., 0])
    total = load.sum(axis=(1, 2))
    with np.errstate(invalid="ignore", divide="ignore"):
        return (load * forward).sum(axis=(1, 2)) / np.where(total > 0.0, total, np.nan)
