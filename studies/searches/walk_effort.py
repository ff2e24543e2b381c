"""What a simulated walk pays in a search that knows no other walk: effort, impact, and what it leaves of its task.

The plan says where the CoM goes over the feet, at which speed and in how long a step; how the legs do it is then free,
and effort (`springfoot.gait.plan.effort`) is that of the walk itself. Cost of transport, muscles' activity and impact
are among the criteria that Veerkamp et al., J. Biomech. 123 (2021) 110530 weigh in planar predictions of gait.
"""

import numpy as np

from springfoot.arrays import NDArray
from springfoot.envs.batch.biped_batch import Biped
from springfoot.envs.physics.model import HIP, SIDES
from springfoot.gait.body.body import GRAVITY
from springfoot.gait.people.cycle import CONTACT_THRESHOLD_BW, PERCENT, find_contacts, on_percent
from springfoot.gait.people.scores import travel
from springfoot.gait.plan.effort import ACTIVATION_TIME, PER_DEGREE, Effort, effort_of_stride

PER_EFFORT = 10.0
"""Price of one unit of effort and impact; chosen, so that no walk pays as much as a fall."""
TASK_TOLERANCE = {"speed": 0.01, "period": 0.02, "place": 0.01, "skipped": 0.01, "travel": 0.01, "unsteady": 0.05}
"""What counts as one: of the speed [m/s], of the plan's stride time [-], of the CoM's place over the foot, root mean
square over the stride [m], of the planned way that a leg skips as its foot lands [m], of the sole's way on the floor in
a stance [m], of the SD of the vertical force over the strides of both legs [body weights]; chosen."""
PER_HELD, PER_MISS = 0.6, 0.01
"""Price of one of these, and of one tolerance that the walk is off its plan; chosen: the plan then says which way to
walk, and hardly how."""


def effort_price(
    record: dict[str, NDArray], index: int, biped: Biped, settled: float, missed: NDArray, impact: float = 1.0
) -> float | None:
    """What walk `index` of a record of `leg_walks.series` pays in strides that begin after `settled` [s]; None if it
    takes too few. `missed` is how far it is off its plan [tolerances] (`leg_cost.misses`), `impact` the price of impact
    over that of effort."""
    found = effort_and_impact(record, index, biped, settled)
    if found is None:
        return None
    effort, landing, held = found
    paid = effort.total + PER_DEGREE * effort.beyond_range + impact * landing
    off = [PER_HELD * held[name] / TASK_TOLERANCE[name] for name in TASK_TOLERANCE]
    return PER_EFFORT * paid + float(np.linalg.norm([*off, *(PER_MISS * missed)]))


def impact_of(force: NDArray, tick: float) -> float:
    """Mean square of `ACTIVATION_TIME` times the rate of a foot's force (T, 2) [body weights], both feet together."""
    change = np.gradient(force, tick, axis=0)
    return float(2 * ACTIVATION_TIME**2 * (change**2).sum(-1).mean())


def effort_and_impact(
    record: dict[str, NDArray], index: int, biped: Biped, settled: float
) -> tuple[Effort, float, dict[str, float]] | None:
    """Effort of the mean stride and impact (`impact_of`), means of both legs, and what `TASK_TOLERANCE` holds, in its
    units."""
    body, tick = biped.body, Biped.tick_dt
    weight = body.total_mass * GRAVITY
    speed = np.gradient(record["com"][:, index, 0], tick)
    ahead = record["com"][:, index, 0] - record["planned_com"][:, index, 0]
    efforts, impacts, periods, travels, forces, speeds, places, landings = [], [], [], [], [], [], [], []
    for side in range(len(SIDES)):
        angle, torque, force = (record[name][:, index, side] for name in ("angle", "moment", "force"))
        strides = find_contacts(force[:, 1], tick, CONTACT_THRESHOLD_BW * weight).strides(settled)
        if len(strides) < 2:
            return None
        turned = angle.copy()
        turned[:, HIP] -= record["pitch"][:, index]
        series = np.column_stack([turned, -torque, force[:, 1] / weight, ahead, speed])
        curves = on_percent(series, strides[:, 0], strides[:, 2], tick)
        mean = curves.mean(0)[: len(PERCENT) - 1]
        joints = angle.shape[-1]
        periods.append(float(np.mean(strides[:, 2] - strides[:, 0])))
        speeds.append(float(mean[:, -1].mean()))
        places.append(float(np.sqrt(np.mean(mean[:, -2] ** 2))))
        efforts.append(
            effort_of_stride(
                body, mean[:, :joints], None, mean[:, joints : 2 * joints], periods[-1], speeds[-1] * periods[-1]
            )
        )
        forces.append(curves[..., 2 * joints])
        first, last = (strides[[0, -1], [0, 2]] / tick).astype(int)
        impacts.append(impact_of(force[first : last + 1] / weight, tick))
        for start, leave, _ in np.floor(strides / tick).astype(int):
            sole = slice(start, leave + 1), index, side
            travels.append(travel(record["material"][sole], record["load"][sole], CONTACT_THRESHOLD_BW * weight))
        for _, leave, land in np.floor(strides / tick).astype(int):
            landings.append(record["phase"][leave:land, index, side].max())
    effort = Effort(**{name: float(np.mean([getattr(each, name) for each in efforts])) for name in vars(efforts[0])})
    held = {
        "speed": float(np.mean(speeds)) - biped.settings.speed,
        "period": float(np.mean(periods)) / (2 * biped.plan.step_time) - 1,
        "place": float(np.mean(places)),
        "skipped": (1.0 - float(np.mean(landings))) * 2 * biped.plan.step_length,
        "travel": float(np.mean(travels)),
        "unsteady": float(np.sqrt(np.concatenate(forces).var(0).mean())),
    }
    return effort, float(np.mean(impacts)), held
