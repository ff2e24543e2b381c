"""Compute the effort of a walk: its cost for the muscles, from joint moments and angles alone.

The same rule holds for a plan, a step of the environment, a recording, a search and a study. The moment of a joint's
muscle fibres is the muscles' moment less that of passive tissue. At ankle and toe the fibres pull through a tendon, a
spring in series: they supply the energy that it stores, and its return is free. The work of fibres in a time dt is

    -M d(theta) + F dF / k,    F = max(M, 0) at ankle and toe,

with M the fibres' moment (extension positive), theta the joint's angle (flexion positive) and k the tendon's stiffness;
the first part is the power that fibres and tendon deliver to the joint. The work of each joint counts alone: fibres of
one joint cannot use the energy that those of another give. Effort uses no data of people's walks. Its terms are
dimensionless, so the same weights (`PRICES`) suit every body and speed.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from springfoot.arrays import NDArray

from ..body.body import ANGLES, GRAVITY, Body
from ..body.leg_dynamics import JOINTS, inverse_dynamics
from ..body.tissue import ANKLE_TENDON, TOE_TENDON, passive_moments
from ..people.human import HumanGait
from .kinetics import planned_leg
from .plan import WalkPlan

EFFORT_SAMPLES = 200
"""Samples of a planned stride; chosen."""
MUSCLE_EFFICIENCY = (0.25, 1.2)
"""Joint work over metabolic energy of muscles that shorten and that are stretched (Margaria 1968)."""
STRENGTH = {"hip": (0.16, 0.11), "knee": (0.16, 0.09), "ankle": (0.10, 0.03), "toe": (0.014, 0.006)}
"""Largest moment in extension and flexion, plantarflexion and dorsiflexion, over body weight times height [-]; chosen,
rounded: the order of the maximal voluntary moments of young adults on dynamometers. Toes: flexors 14 N m (Goldmann &
Brueggemann, J. Anat. 221 (2012) 187), extensors by the forces and levers of the model at `TOE_TENDON`."""
VOLUME = {"hip": (0.25, 0.13), "knee": (0.25, 0.10), "ankle": (0.15, 0.033), "toe": (0.02, 0.015)}
"""Volume of the muscles that extend and that flex each joint, over the volume of all the leg's muscles [-]; rounded,
after Handsfield et al., J. Biomech. 47 (2014) 631-638; of the toe a guess. The volume weighs the
squared activation: a small muscle tires, but costs little."""
ACTIVATION_TIME = 0.05
"""Time constant with which a muscle's activation follows its excitation [s]; chosen, as models of muscles have it."""
TENDON_GIVE = (0.0, 0.0, 1.0 / ANKLE_TENDON, 1.0 / TOE_TENDON)
"""Turn of a joint for each N m that its muscles pull on their tendon [rad/(N m)] at 1.70 m and 63 kg, in the order of
`JOINTS`; tendons of hip and knee do not give."""
MOTION_RANGE_DEG = {"knee": (0.0, 135.0), "ankle": (-48.0, 18.0), "toe": (-30.0, 70.0)}
"""Least and largest angle [deg], dorsiflexion and toe up positive: ranges of motion of the American Academy of
Orthopaedic Surgeons (1965)."""

PRICES = (1.0, 1.0, 1.0, 3.0)
"""Price of a unit of work, activation, its rate, and acceleration; chosen: energy and squared excitation weigh alike,
and acceleration no more than either. Without a price on acceleration a foot may swing up and down for nothing."""
PER_DEGREE = 0.1
"""Effort of a joint beyond its range, in a search [1/deg]; chosen."""


# The work of a short interval ---------------------------------------------------------------------------------


def interval_work(before: Any, moment: Any, after: Any, first: Any, second: Any, give: Any) -> Any:
    """Return the work [J] of a joint's fibres in the first and in the second half of one interval.

    The moment is linear between the middles of intervals. Arguments are numbers, as in kernels, or arrays.

    Args:
        before, moment, after: the fibres' moment, mean over the interval before, this one and the next [N m].
        first, second: work of fibres and tendon on the joint in each half of this interval [J].
        give: of the tendon [rad/(N m)].
    """
    pull = np.maximum(moment, 0.0)
    begins = 0.5 * (np.maximum(before, 0.0) + pull)
    ends = 0.5 * (pull + np.maximum(after, 0.0))
    return first + 0.5 * give * (pull**2 - begins**2), second + 0.5 * give * (ends**2 - pull**2)


def metabolic_energy(work: Any) -> Any:
    """Return the energy [J] that fibres spend on positive or negative `work` [J], by `MUSCLE_EFFICIENCY`."""
    return np.maximum(work, 0.0) / MUSCLE_EFFICIENCY[0] + np.maximum(-work, 0.0) / MUSCLE_EFFICIENCY[1]


def strengths(body: Body) -> NDArray:
    """Return the largest moments (4, 2) [N m] of a sound leg's muscles in extension and in flexion.

    Joints are in the order of `JOINTS`.
    """
    return body.mass * GRAVITY * body.height * np.array([STRENGTH[joint] for joint in JOINTS])


def volume_weights() -> NDArray:
    """Return the weights (4, 2) of each joint's extensors and flexors in the activation: `VOLUME` over its mean [-]."""
    volume = np.array([VOLUME[joint] for joint in JOINTS])
    return volume / volume.mean()


# The effort of a walk -----------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Muscle:
    """Factors on properties of the muscles, to study their effect."""

    tissue: float = 1.0
    """Factor on passive moments (`tissue.passive_moments`)."""
    tendon: float = 1.0
    """Factor on the give of the Achilles tendon."""
    toe_tendon: float = 1.0
    """Factor on the give of the toes' tendons."""


AS_IS = Muscle()
"""Muscles without changes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MuscleUse:
    """Use of the muscles of L legs over some time, by leg and joint; joints in the order of `JOINTS`."""

    work: NDArray
    """(L, joint, 2) positive and negative work of the fibres [J]."""
    activation: NDArray
    """(L, joint) integral over time of the squared activation, weighted by volume [s]."""
    rate: NDArray
    """(L, joint) integral over time of the squared `ACTIVATION_TIME` x activation rate, weighted by volume [s]; here
    the activation of flexors counts negative."""

    @property
    def energy(self) -> NDArray:
        """(L, joint) metabolic energy of the fibres' work [J]."""
        return metabolic_energy(self.work).sum(-1)


def muscle_use(
    moment: NDArray, delivered: NDArray, tick: float, strength: NDArray, scale: float, muscle: Muscle = AS_IS
) -> MuscleUse:
    """Compute the use of the muscles of L legs over S consecutive intervals, without the first and the last.

    Args:
        moment: (S, L, 4) moment of the fibres, mean over each interval [N m], extension positive.
        delivered: (S, L, 4, 2) work of fibres and tendon on each joint in the two halves of the interval [J].
        tick: length of an interval [s].
        strength: (L, 4, 2) largest moments of each leg's muscles, extension and flexion [N m].
        scale: factor on the stiffness of the tendons for this body, `Body.strength_scale` [-].
        muscle: factors on properties of the muscles.
    """
    # Intervals 1 to S - 2 have an interval before and one after: [:-2], [1:-1] and [2:] are before, they and after.
    give = np.array(TENDON_GIVE) * [1.0, 1.0, muscle.tendon, muscle.toe_tendon] / scale
    halves = np.moveaxis(delivered[1:-1], -1, 0)
    work = np.stack(interval_work(moment[:-2], moment[1:-1], moment[2:], halves[0], halves[1], give))
    extends = moment > 0.0
    activation = moment / np.where(extends, strength[..., 0], strength[..., 1])
    squared_rate = (ACTIVATION_TIME * np.diff(activation, axis=0) / tick) ** 2  # between the middles of intervals
    weight = np.where(extends, *np.moveaxis(volume_weights(), -1, 0))[1:-1]
    return MuscleUse(
        work=np.stack([np.maximum(work, 0.0).sum((0, 1)), np.minimum(work, 0.0).sum((0, 1))], -1),
        activation=(weight * activation[1:-1] ** 2).sum(0) * tick,
        rate=(weight * 0.5 * (squared_rate[:-1] + squared_rate[1:])).sum(0) * tick,
    )


@dataclass(frozen=True, kw_only=True)
class Effort:
    """Terms of the effort of a walk, both legs together."""

    work: float
    """Metabolic energy of the fibres' work over body weight times distance [-]."""
    activation: float
    """Sum over joints of the mean squared activation: the fibres' moment over `STRENGTH`, weighted by volume [-]."""
    rate: float
    """Sum over joints of the mean squared `ACTIVATION_TIME` times rate of the activation [-]. A first-order muscle's
    mean squared excitation is the sum of this and `activation`."""
    acceleration: float
    """Sum over hip, knee and ankle of the mean squared `ACTIVATION_TIME`^2 times angular acceleration [-]; joint
    accelerations cost in the simulations of Falisse et al., J. R. Soc. Interface 16 (2019) 20190402, too."""
    beyond_range: float
    """Sum over joints of the largest angle beyond `MOTION_RANGE_DEG` [deg]; searches alone price it."""

    @property
    def total(self) -> float:
        """Return the effort: the sum of `terms`, each times its weight in `PRICES` [-]."""
        return float(np.dot(PRICES, self.terms))

    @property
    def terms(self) -> tuple[float, float, float, float]:
        """Return the terms with a weight in `PRICES`, in its order: work, activation, rate and acceleration [-]."""
        return self.work, self.activation, self.rate, self.acceleration


def mean_squared_acceleration(velocity: NDArray, tick: float) -> float:
    """Return the term `Effort.acceleration` [-] of L legs, from joint velocities (S, L, 4) [rad/s].

    The S samples are `tick` [s] apart, joints in the order of `JOINTS`; the toe, the last joint, does not count.
    """
    change = np.diff(velocity[..., : JOINTS.index("toe")], axis=0) / tick
    return float(ACTIVATION_TIME**4 * (change**2).mean(0).sum())


def beyond_range(angle: NDArray) -> float:
    """Return by how much the joints of a leg leave `MOTION_RANGE_DEG` [deg]: the sum of their largest excesses.

    `angle` (S, 4) [rad] are S samples of the joints in the order of `JOINTS`.
    """
    angle_deg = np.degrees(angle)
    beyond = 0.0
    for joint, (least, most) in MOTION_RANGE_DEG.items():
        curve = angle_deg[:, JOINTS.index(joint)]
        beyond += max(0.0, float(curve.max()) - most) + max(0.0, least - float(curve.min()))
    return beyond


def effort_of(plan: WalkPlan, muscle: Muscle = AS_IS) -> Effort:
    """Compute the effort of a stride of a plan, both legs, with joint moments by inverse dynamics."""
    body = plan.body
    phase = np.arange(EFFORT_SAMPLES) / EFFORT_SAMPLES
    motion, load = planned_leg(plan, phase)
    dynamics = inverse_dynamics(body, motion, load, plan.slope)
    moment = np.stack([dynamics.moment[joint] for joint in JOINTS], -1)
    angle, rate = (_segments_to_joints(turns) for turns in (motion.turn, motion.rate))
    angle[:, JOINTS.index("hip")] += plan.slope  # turns are to the ground's normal, the hip's angle to the vertical
    return effort_of_stride(body, angle, rate, moment, plan.stride_time, 2 * plan.step_length, muscle)


def effort_of_people(human: HumanGait, body: Body) -> Effort:
    """Compute the effort of people's mean curves, on a body of their height (not checked).

    The toe's moment is not measured: it is taken to be that of passive tissue, so that its muscles do nothing.
    """
    phase = np.arange(EFFORT_SAMPLES) / EFFORT_SAMPLES
    angle, rate = (np.stack([curve(name, phase) for name in ANGLES], -1) for curve in (human.mean, human.rate))
    moment = passive_moments(body, angle)
    moment[:, : JOINTS.index("toe")] = body.mass * np.stack(
        [human.mean(f"{joint}_moment", phase) for joint in JOINTS if joint != "toe"], -1
    )
    time = human.stride_time
    return effort_of_stride(body, angle, rate / time, moment, time, 2 * human.step_length)


def effort_of_stride(
    body: Body,
    angle: NDArray,
    rate: NDArray,
    moment: NDArray,
    stride_time: float,
    distance: float,
    muscle: Muscle = AS_IS,
) -> Effort:
    """Compute the effort of a stride of `distance` [m] in `stride_time` [s] with equal legs, half a stride apart.

    Columns of `angle`, `rate` and `moment` (S, 4) are hip (thigh to the vertical), knee, ankle and toe of one leg, rows
    S even samples of the stride. Flexion and dorsiflexion [rad], [rad/s] are positive; in moments [N m] extension and
    plantarflexion.
    """
    tick = stride_time / len(angle)
    fibres = moment - muscle.tissue * passive_moments(body, angle)
    # One leg, as an axis of length 1: its sums are doubled for both.
    moments, half = (_with_neighbours(values)[:, None] for values in (fibres, -fibres * rate * tick / 2))
    delivered = np.stack([half, half], -1)
    use = muscle_use(moments, delivered, tick, strengths(body), body.strength_scale, muscle)
    return Effort(
        work=float(2 * use.energy.sum() / (body.total_mass * GRAVITY * distance)),
        activation=float(2 * use.activation.sum() / stride_time),
        rate=float(2 * use.rate.sum() / stride_time),
        acceleration=2 * mean_squared_acceleration(_with_neighbours(rate)[:-1], tick),
        beyond_range=beyond_range(angle),
    )


def _with_neighbours(values: NDArray) -> NDArray:
    """Return values (S, ...) of a stride with the last one in front and the first one behind, as strides repeat."""
    return np.concatenate([values[-1:], values, values[:1]])


def _segments_to_joints(turns: NDArray) -> NDArray:
    """Return joint angles or rates (..., 4) of hip, knee, ankle, toe from those of segments (`LEG_SEGMENTS`).

    Flexion and dorsiflexion are positive; the hip's is the thigh to the normal of the ground.
    """
    thigh, shank, foot, toe = np.moveaxis(turns, -1, 0)
    return np.stack([thigh, thigh - shank, foot - shank, toe - foot], -1)
