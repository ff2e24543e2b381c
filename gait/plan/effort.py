"""Compute the effort of a stride, planned or simulated: work and muscle excitation of its moments, joint accelerations.

Effort uses no data of people's walks. All terms are dimensionless, so the same prices suit every body and speed.
"""

from dataclasses import dataclass

import numpy as np

from springfoot.arrays import NDArray

from ..body.body import GRAVITY, Body
from ..body.leg import JOINTS, inverse_dynamics
from ..body.tissue import TENDON, passive_moments
from .kinetics import planned_leg
from .plan import WalkPlan

EFFORT_SAMPLES = 200
"""Samples of the stride; chosen."""
MUSCLE_EFFICIENCY = (0.25, 1.2)
"""Joint work over metabolic energy of muscles that shorten and that are stretched (Margaria 1968)."""
STRENGTH = {"hip": (0.16, 0.11), "knee": (0.16, 0.09), "ankle": (0.10, 0.03), "toe": (0.015, 0.015)}
"""Largest moment in extension and flexion, plantarflexion and dorsiflexion, over body weight times height [-]; chosen,
rounded: the order of the maximal voluntary moments of young adults on dynamometers; of the toe a guess."""
VOLUME = {"hip": (0.25, 0.13), "knee": (0.25, 0.10), "ankle": (0.15, 0.033), "toe": (0.02, 0.015)}
"""Volume of the muscles that extend and that flex each joint, over the volume of all the leg's muscles [-]; rounded,
after Handsfield et al., J. Biomech. 47 (2014) 631-638; of the toe a guess. The volume weighs the
squared activation: a small muscle tires, but costs little."""
ACTIVATION_TIME = 0.05
"""Time constant with which a muscle's activation follows its excitation [s]; chosen, as models of muscles have it."""
_ANKLE = JOINTS.index("ankle")
MOTION_RANGE_DEG = {"knee": (0.0, 135.0), "ankle": (-48.0, 18.0), "toe": (-30.0, 70.0)}
"""Least and largest angle [deg], dorsiflexion and toe up positive: ranges of motion of the American Academy of
Orthopaedic Surgeons (1965)."""

PRICES = (1.0, 1.0, 1.0, 3.0)
"""Price of a unit of work, activation, its rate, and acceleration; chosen: energy and squared excitation weigh alike,
and acceleration no more than either. Without a price on acceleration a foot may swing up and down for nothing."""
PER_DEGREE = 0.1
"""Effort of a joint beyond its range, in a search [1/deg]; chosen."""


@dataclass(frozen=True, kw_only=True)
class Effort:
    """Terms of the effort of one stride, both legs together."""

    work: float
    """Metabolic energy of the work of hips, knees and ankles over body weight times distance [-]."""
    activation: float
    """Sum over joints of the mean squared activation, moment over `STRENGTH`; the toe's without its tissue [-]."""
    rate: float
    """Sum over joints of the mean squared `ACTIVATION_TIME` times rate of the activation [-]. A first-order muscle's
    mean squared excitation is the sum of this and `activation`."""
    acceleration: float
    """Sum over hip, knee and ankle of the mean squared `ACTIVATION_TIME`^2 times angular acceleration [-]; joint
    accelerations cost in the simulations of Falisse et al., J. R. Soc. Interface 16 (2019) 20190402, too."""
    beyond_range: float
    """Sum over joints of the largest angle beyond `MOTION_RANGE_DEG` [deg]."""

    @property
    def total(self) -> float:
        """Return the effort at `PRICES`."""
        return float(np.dot(PRICES, self.terms))

    @property
    def terms(self) -> tuple[float, float, float, float]:
        """Return the terms that have a price: work, activation, its rate, acceleration."""
        return self.work, self.activation, self.rate, self.acceleration


@dataclass(frozen=True, kw_only=True)
class Muscle:
    """Factors on properties of the muscles, to study their effect."""

    tissue: float = 1.0
    """Factor on passive moments (`tissue.passive_moments`)."""
    tendon: float = 1.0
    """Factor on the give of the Achilles tendon."""


AS_IS = Muscle()
"""Muscles without changes."""


def effort_of(plan: WalkPlan, muscle: Muscle = AS_IS) -> Effort:
    """Compute the effort of a planned stride, with moments by inverse dynamics."""
    body = plan.body
    phase = np.arange(EFFORT_SAMPLES) / EFFORT_SAMPLES
    motion, load = planned_leg(plan, phase)
    dynamics = inverse_dynamics(body, motion, load, plan.slope)
    moment = np.stack([dynamics.moment[joint] for joint in JOINTS], -1)
    angle, rate = (_joints(turns) for turns in (motion.turn, motion.rate))
    return effort_of_stride(body, angle, rate, moment, plan.stride_time, 2 * plan.step_length, muscle)


def effort_of_stride(
    body: Body,
    angle: NDArray,
    rate: NDArray | None,
    moment: NDArray,
    stride_time: float,
    distance: float,
    muscle: Muscle = AS_IS,
) -> Effort:
    """Compute the effort of a stride of `distance` [m] in `stride_time` [s] with equal legs, half a stride apart.

    Columns of `angle`, `rate` and `moment` (S, 4) are hip (thigh to the vertical), knee, ankle and toe of one leg, rows
    even samples of the stride. Flexion and dorsiflexion [rad], [rad/s] are positive; in moments [N m] extension and
    plantarflexion. Without a `rate` the angle is differentiated.
    """
    tick = stride_time / len(angle)
    toe = JOINTS.index("toe")
    rate = _change(angle, tick) if rate is None else rate
    acceleration = _change(rate[:, :toe], tick)
    # Muscles supply the moments beyond those of passive tissue.
    moment = moment - muscle.tissue * passive_moments(body, angle)
    power = (-moment * rate)[:, :toe]
    # Calf fibres also supply the rate of the tendon's elastic energy, pull^2 / (2 K).
    pull = np.maximum(moment[:, _ANKLE], 0.0)
    power[:, _ANKLE] += muscle.tendon * pull * _change(pull, tick) / (TENDON * body.stiffness_scale)
    # metabolic energy [J] of one leg
    spent = (
        np.maximum(power, 0.0).sum() / MUSCLE_EFFICIENCY[0] + np.maximum(-power, 0.0).sum() / MUSCLE_EFFICIENCY[1]
    ) * tick
    activation = moment / _strength(body, moment)
    change = _change(activation, tick)
    angle_deg = np.degrees(angle)
    beyond = 0.0
    for joint, (least, most) in MOTION_RANGE_DEG.items():
        curve = angle_deg[:, JOINTS.index(joint)]
        beyond += max(0.0, float(curve.max()) - most) + max(0.0, least - float(curve.min()))
    weight = _of_groups(VOLUME, moment) / np.mean(list(VOLUME.values()))
    return Effort(
        work=float(2 * spent / (body.total_mass * GRAVITY * distance)),
        activation=float(2 * np.mean(weight * activation**2, 0).sum()),
        rate=float(2 * ACTIVATION_TIME**2 * np.mean(weight * change**2, 0).sum()),
        acceleration=float(2 * ACTIVATION_TIME**4 * np.mean(acceleration**2, 0).sum()),
        beyond_range=beyond,
    )


def _change(values: NDArray, tick: float) -> NDArray:
    """Return the time derivative, by central differences, of values (S, ...) that repeat every stride."""
    return (np.roll(values, -1, 0) - np.roll(values, 1, 0)) / (2 * tick)


def _joints(turns: NDArray) -> NDArray:
    """Return joint angles or rates (..., 4) of hip, knee, ankle, toe from those of segments (`LEG_SEGMENTS`).

    Flexion and dorsiflexion are positive; the hip's is the thigh to the vertical.
    """
    thigh, shank, foot, toe = np.moveaxis(turns, -1, 0)
    return np.stack([thigh, thigh - shank, foot - shank, toe - foot], -1)


def _strength(body: Body, moment: NDArray) -> NDArray:
    """Return the strength (..., 4) [N m] of the muscles that make the moments (..., 4), by their signs."""
    return body.mass * GRAVITY * body.height * _of_groups(STRENGTH, moment)


def _of_groups(table: dict[str, tuple[float, float]], moment: NDArray) -> NDArray:
    """Return the table's number (..., 4) for extensors where the moment (..., 4) is positive, else for flexors."""
    extending, flexing = np.array([table[joint] for joint in JOINTS]).T
    return np.where(moment > 0.0, extending, flexing)
