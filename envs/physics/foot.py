"""Describe one foot, sound or prosthetic, as physics: muscles or a device's springs at ankle and toe, an orthosis,
segments of other mass.

The law of the springs' torque is in `model`, the stiffness over the stride and its bound by a tendon in
`..control.stiffness_control`. Angles are those of the joints (dorsiflexion, toe-up positive). Numbers of a device, or
an orthosis, are the same on every body: they do not scale.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import inf, pi

from springfoot.gait.body.body import Body
from springfoot.gait.springs.stiffness import StiffnessSchedule

WAYS = ("dorsiflexion", "plantarflexion")
"""Ways in which a spring may engage."""


@dataclass(frozen=True, kw_only=True)
class Spring:
    """A spring of fixed stiffness and rest angle: torque = stiffness (rest - angle - damping_time x angular rate)."""

    stiffness: float = 0.0
    """[N m/rad]; 0 for none."""
    rest: float = 0.0
    """Angle without torque [rad]."""
    damping_time: float | None = None
    """Damping over stiffness [s]; None for that of the joint's muscles (`envs.physics.model.damping_times`)."""
    armature: float | None = None
    """Inertia of the joint beside its own [kg m^2]; None for the usual one, of `envs.physics.model.armatures_of`."""
    table: tuple[tuple[float, float], ...] = ()
    """Angles [rad], ascending, and torques [N m], falling, in place of stiffness and rest angle; lines between them."""
    engages: str | None = None
    """Way beyond `rest` in which alone it acts, one of `WAYS` (of a toe: up, down); None for both. Only an orthosis may
    act one way, then without damping."""

    @property
    def steepest(self) -> float:
        """Return the largest fall of the torque with the angle [N m/rad]: the stiffness, or that of the line."""
        falls = [(torque - below) / (above - angle) for (angle, torque), (above, below) in pairwise(self.table)]
        return max([self.stiffness, *falls])

    @property
    def slack(self) -> tuple[float, float]:
        """Return the lowest and the highest angle without torque [rad]; no joint reaches -pi or pi.

        Both are `rest` for a spring that acts both ways; one that engages in dorsiflexion has no torque below it.
        """
        lowest = -pi if self.engages == WAYS[0] else self.rest  # dorsiflexion
        highest = pi if self.engages == WAYS[1] else self.rest  # plantarflexion
        return lowest, highest


LOCK = Spring(stiffness=50_000.0, damping_time=0.01)
"""Spring that locks a joint at 0: 100 N m, an ankle's largest moment in walking, move it by 0.1 deg. Chosen: with a
damping time of five physics steps or more, moments are as with any stiffer or softer lock (5 000 to 100 000 N
m/rad). The fibre work changes little: on a rigid right foot that of an earlier learned person was 3.58 J/kg/m at
20 000, 3.66 here, 3.71 at 100 000 (63 kg, 1.2 m/s asked, 1.18, 1.20, 1.21 walked; 20 episodes of 5 s).

MuJoCo solves contacts with the inertia M, and moves the joints by M + h K beta, h the physics step. Without an
armature (`envs.physics.model.armatures_of`), contacts take a locked foot for a light one that swings freely, and give
the body energy. Any armature from 0.1 to 5 kg m^2 gives the same walk to 2 %."""


@dataclass(frozen=True, kw_only=True)
class FootJoint:
    """An ankle or a toe joint."""

    device: Spring | None = None
    """Spring in place of muscles; None for muscles, with stiffness set by the policy."""
    rest: float | None = None
    """Rest angle of an adaptive device, with stiffness set by the policy [rad]; None for muscles, which have the
    planned one over the stride."""
    strength: float = 1.0
    """Largest torque of the muscles downwards (plantarflexion) over that of the sound joint [-]."""
    acts_in_swing: bool = True
    """False for an ankle with muscles that are slack while the leg swings; its passive tissue stays."""
    orthosis: Spring | None = None
    """Spring beside the joint, which always acts."""

    @property
    def has_muscles(self) -> bool:
        """Return True for a joint without a device: neither a spring in place of muscles nor an adaptive device."""
        return self.device is None and self.rest is None

    @property
    def is_locked(self) -> bool:
        """Return True for a joint with the device `LOCK`."""
        return self.device == LOCK


@dataclass(frozen=True, kw_only=True)
class Foot:
    """One foot, and the shank above it."""

    kind: str = "intact"
    """Name of the kind, one of `springfoot.envs.settings.feet`."""
    ankle: FootJoint = FootJoint()
    toe: FootJoint = FootJoint()
    schedule: StiffnessSchedule | None = None
    """Stiffness and rest angle over the stride of the devices at ankle and toe, in place of their own."""
    one_piece: bool = False
    """True for a foot without a ball to roll over: it touches the ground with heel and toe tip alone."""
    shank_mass_ratio: float = 1.0
    """Mass of the shank over the intact one's [-]."""
    shank_com_ratio: float = 1.0
    """Distance of the shank's CoM from the knee over the intact one's [-]."""
    shank_inertia_ratio: float = 1.0
    """Inertia of the shank about its CoM over the intact one's [-]."""
    foot_mass_ratio: float = 1.0
    """Mass of foot and toe over the intact ones' [-]."""
    foot_inertia_ratio: float = 1.0
    """Inertias of foot and toe about their CoMs over the intact ones' [-]."""

    @property
    def joints(self) -> tuple[FootJoint, FootJoint]:
        """Return ankle and toe."""
        return self.ankle, self.toe


INTACT = Foot()
"""The foot of a sound leg."""
Feet = tuple[Foot, Foot]
"""The left and the right foot."""
SOUND: Feet = (INTACT, INTACT)


def act_one_way(feet: Feet) -> bool:
    """Return whether the orthosis of either foot, at ankle or toe, acts in one direction alone."""
    return any(joint.orthosis is not None and joint.orthosis.engages for foot in feet for joint in foot.joints)


@dataclass(frozen=True, kw_only=True)
class LegSegments:
    """Masses [kg], distances [m] and inertias [kg m^2] of one leg, in the order thigh, shank, foot, toe."""

    mass: tuple[float, float, float, float]
    com: tuple[tuple[float, float], ...]
    """CoM of each segment, forward and up from its joint, in the segment's frame."""
    inertia: tuple[float, float, float, float]
    """Inertia of each segment about its CoM."""


def leg_segments(body: Body, foot: Foot) -> LegSegments:
    """Return the segments of the leg of `body` that ends in `foot`: the body's own, times the ratios of the foot."""
    forward, below = body.foot_com
    return LegSegments(
        mass=(
            body.thigh_mass,
            foot.shank_mass_ratio * body.shank_mass,
            foot.foot_mass_ratio * body.foot_mass,
            foot.foot_mass_ratio * body.toe_mass,
        ),
        com=(
            (0.0, -body.thigh_com),
            (0.0, -foot.shank_com_ratio * body.shank_com),
            (forward, -below),
            (body.toe_com, 0.0),
        ),
        inertia=(
            body.thigh_inertia,
            foot.shank_inertia_ratio * body.shank_inertia,
            foot.foot_inertia_ratio * body.foot_inertia,
            foot.foot_inertia_ratio * body.toe_inertia,
        ),
    )


def total_mass(body: Body, feet: Feet) -> float:
    """Return the mass of body and load with these feet [kg]."""
    legs = [(leg_segments(body, foot).mass, leg_segments(body, INTACT).mass) for foot in feet if foot != INTACT]
    return body.total_mass + sum(sum(own) - sum(intact) for own, intact in legs)


def torque_range(limit: float, joint: FootJoint) -> tuple[float, float]:
    """Return lowest and highest torque [N m] of a joint's muscles, or of its device, which has no limits.

    `limit` is the largest torque of a sound joint's muscles [N m]. Weak muscles are weak downwards alone, which is
    plantarflexion.
    """
    return (-inf, inf) if joint.device else (-joint.strength * limit, limit)
