"""Describe the body: every length, mass, centre of mass and inertia from height, body mass, proportions and a load.

Sources. Thesis: D. W. Nam, DGIST 2016, Table 1 (ratios of height). Winter: D. A. Winter, Biomechanics and Motor Control
of Human Movement, 4th ed. 2009, Table 4.1 (mass fractions, centres of mass, radii of gyration) and Figure 4.1 (segment
lengths). All ratios of masses are of body mass, all ratios of lengths of height unless said.
"""

from dataclasses import dataclass
from math import atan2, cos, hypot, sin, sqrt
from typing import Literal, get_args

import numpy as np

from springfoot.arrays import NDArray
from springfoot.errors import require_choice, require_within

ANGLES = ("thigh", "knee", "ankle", "toe")
"""Curves that give the posture of a leg, from the hip down. Thigh is to the vertical: hip = thigh + trunk pitch."""
GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""

REFERENCE_HEIGHT = 1.70
"""Height [m] of the thesis's body; `length_scale` is 1 here."""
HEEL_RADIUS = 0.04
"""Radius [m] of the heel's contact sphere at 1.70 m; chosen: a rounded heel with a soft pad at most 8 mm deep."""
REFERENCE_MASS = 63.0
"""Mass [kg] of the thesis's body; `mass_scale` is 1 here."""

HEIGHT_RANGE = (1.0, 2.3)
"""Accepted heights [m]; chosen."""
MASS_RANGE = (20.0, 250.0)
"""Accepted body masses [kg]; chosen."""
BMI_RANGE = (10.0, 80.0)
"""Accepted body-mass indices [kg/m^2]; chosen, wider than people's."""
LEG_RATIO_RANGE = (0.94, 1.06)
"""Accepted leg ratios [-]: +-2 SD of adults of one height. SD 3 %: that of sitting height over height is about 0.014,
and thigh and shank are 0.49 of height (ANSUR II, Gordon et al. 2014, Natick/TR-15/007; remembered, not read)."""
FOOT_RATIO_RANGE = (0.93, 1.07)
"""Accepted foot ratios [-]: +-2 SD of adults of one height. SD 3.5 %: about 9 mm of 271 mm (ANSUR II; remembered)."""
CARRIED_RATIO_RANGE = (0.0, 0.4)
"""Accepted loads [body masses]; chosen."""
CARRIED_BEHIND = 0.2
"""Distance of a load's centre behind the trunk's CoM, at the same height [m at 1.70 m]; chosen: half the depth of the
chest and half of a backpack 0.15 m thick."""
CARRIED_GYRATION = {"back": 0.15, "waist": 0.11}
"""Radius of gyration of a load [m at 1.70 m]; chosen: of a uniform box 0.5 m high and 0.15 m thick on the back, and of
a ring 0.16 m in radius around the waist."""
WAIST_ABOVE_HIP = 0.1
"""Height of a belt around the waist above the hip joints [m at 1.70 m]; chosen: about that of the iliac crests."""
CarriedAt = Literal["back", "waist"]
"""Places of a load on the trunk."""


def gravity(slope: float) -> NDArray:
    """Return the acceleration of gravity (forward, up) (2,) [m/s^2] in a frame that leans with a `slope` [rad], uphill
    positive."""
    return -GRAVITY * np.array([sin(slope), cos(slope)])


@dataclass(frozen=True)
class Body:
    """A person, of average proportions unless said otherwise; properties in m, kg and kg m^2, one leg each.

    Inertias are sagittal, about the segment's own centre of mass (CoM). Proportions move lengths, not segment masses.
    Raises `SpringfootError` for a body outside the ranges at the head of this module.
    """

    height: float = REFERENCE_HEIGHT
    """Standing height [m]."""
    mass: float = REFERENCE_MASS
    """Body mass [kg], without a load."""
    leg_ratio: float = 1.0
    """Length of thigh and shank over the average at that height; the trunk takes the rest."""
    foot_ratio: float = 1.0
    """Length of the foot over the average at that height."""
    carried_ratio: float = 0.0
    """Mass of a load over body mass, fixed to the trunk."""
    carried_at: CarriedAt = "back"
    """Place of the load: a backpack behind the trunk's CoM, or a belt around the waist, which leaves the trunk
    upright."""

    def __post_init__(self) -> None:
        require_within("height", self.height, HEIGHT_RANGE, "m")
        require_within("mass", self.mass, MASS_RANGE, "kg")
        require_within("body-mass index mass/height^2", self.mass / self.height**2, BMI_RANGE, "kg/m^2")
        require_within("leg_ratio", self.leg_ratio, LEG_RATIO_RANGE, "(relative)")
        require_within("foot_ratio", self.foot_ratio, FOOT_RATIO_RANGE, "(relative)")
        require_within("carried_ratio", self.carried_ratio, CARRIED_RATIO_RANGE, "(relative)")
        require_choice("carried_at", self.carried_at, get_args(CarriedAt))

    # Scales against the reference body --------------------------------------------------------------------

    @property
    def length_scale(self) -> float:
        """Height / 1.70 m."""
        return self.height / REFERENCE_HEIGHT

    @property
    def mass_scale(self) -> float:
        """Mass / 63 kg."""
        return self.mass / REFERENCE_MASS

    @property
    def strength_scale(self) -> float:
        """Mass scale x length scale: how torque limits and joint damping, the body's own strength, scale."""
        return self.mass_scale * self.length_scale

    @property
    def stiffness_scale(self) -> float:
        """Total mass / 63 kg x length scale: how stiffness and torque that carry body and load scale."""
        return self.total_mass / REFERENCE_MASS * self.length_scale

    # Lengths ------------------------------------------------------------------------------------------------

    @property
    def heel_to_ankle(self) -> float:
        """Back of the heel to the ankle axis, along the sole (thesis l_bf)."""
        return 0.051 * self.height * self.foot_ratio

    @property
    def ankle_to_toe_joint(self) -> float:
        """Ankle axis to toe joint, along the sole (thesis Table 1, appendix l_ft)."""
        return 0.061 * self.height * self.foot_ratio

    @property
    def toe_length(self) -> float:
        """Toe joint to toe tip (thesis l_toe, from SizeKorea)."""
        return 0.04 * self.height * self.foot_ratio

    @property
    def foot_length(self) -> float:
        """Heel to toe tip (thesis l_foot, 0.152 of height: the sum of its three parts)."""
        return self.heel_to_ankle + self.ankle_to_toe_joint + self.toe_length

    @property
    def ankle_height(self) -> float:
        """Ankle axis above the sole (thesis l_an)."""
        return 0.04 * self.height

    @property
    def toe_joint_height(self) -> float:
        """Toe joint above the sole: 2 cm at 1.70 m (chosen, half the thickness of the ball of the foot)."""
        return 0.02 * self.length_scale

    @property
    def shank_length(self) -> float:
        """Knee to ankle (thesis l_shank)."""
        return 0.245 * self.height * self.leg_ratio

    @property
    def thigh_length(self) -> float:
        """Hip to knee (thesis l_thigh)."""
        return 0.245 * self.height * self.leg_ratio

    @property
    def leg_length(self) -> float:
        """Hip above the floor when standing straight."""
        return self.thigh_length + self.shank_length + self.ankle_height

    @property
    def trunk_length(self) -> float:
        """Greater trochanter to glenohumeral joint, Winter's HAT (head, arms, trunk) segment (Figure 4.1).

        Longer legs make it shorter by as much as they gain, so that all lengths add up to the height.
        """
        return (0.288 - 0.49 * (self.leg_ratio - 1.0)) * self.height  # 0.49: thigh and shank of average legs

    # Masses -------------------------------------------------------------------------------------------------

    @property
    def total_mass(self) -> float:
        """Mass of body and load."""
        return self.mass + self.carried_mass

    @property
    def trunk_mass(self) -> float:
        """Head, arms and trunk (Winter HAT)."""
        return 0.678 * self.mass

    @property
    def thigh_mass(self) -> float:
        """One thigh (Winter)."""
        return 0.100 * self.mass

    @property
    def shank_mass(self) -> float:
        """One shank (Winter)."""
        return 0.0465 * self.mass

    @property
    def foot_mass(self) -> float:
        """One foot without its toe: 80 % of Winter's foot (0.0145); the split is chosen."""
        return 0.8 * 0.0145 * self.mass

    @property
    def toe_mass(self) -> float:
        """One toe segment: 20 % of Winter's foot (0.0145)."""
        return 0.2 * 0.0145 * self.mass

    # Centres of mass ----------------------------------------------------------------------------------------

    @property
    def trunk_com_above_hip(self) -> float:
        """HAT CoM above the hip: 0.626 of its length (Winter)."""
        return 0.626 * self.trunk_length

    @property
    def thigh_com(self) -> float:
        """Thigh CoM from the hip: 0.433 of its length (Winter)."""
        return 0.433 * self.thigh_length

    @property
    def shank_com(self) -> float:
        """Shank CoM from the knee: 0.433 of its length (Winter)."""
        return 0.433 * self.shank_length

    @property
    def foot_com(self) -> tuple[float, float]:
        """Foot CoM (forward of the ankle, below the ankle): mid-way from heel to toe joint, half the ankle height.

        Winter's foot (0.5 from ankle to metatarsal) includes the toes, which are a segment of their own here.
        """
        return (self.ankle_to_toe_joint - self.heel_to_ankle) / 2, self.ankle_height / 2

    @property
    def toe_com(self) -> float:
        """Toe CoM forward of the toe joint: half its length (uniform rod)."""
        return self.toe_length / 2

    # Inertias -----------------------------------------------------------------------------------------------

    @property
    def trunk_inertia(self) -> float:
        """HAT, radius of gyration 0.496 of its length (Winter)."""
        return self.trunk_mass * (0.496 * self.trunk_length) ** 2

    @property
    def thigh_inertia(self) -> float:
        """Thigh, radius of gyration 0.323 of its length (Winter)."""
        return self.thigh_mass * (0.323 * self.thigh_length) ** 2

    @property
    def shank_inertia(self) -> float:
        """Shank, radius of gyration 0.302 of its length (Winter)."""
        return self.shank_mass * (0.302 * self.shank_length) ** 2

    @property
    def foot_inertia(self) -> float:
        """Foot, radius of gyration 0.475 of its length from ankle to toe joint (Winter: malleolus to metatarsal II)."""
        length = hypot(self.ankle_to_toe_joint, self.ankle_height - self.toe_joint_height)
        return self.foot_mass * (0.475 * length) ** 2

    @property
    def toe_inertia(self) -> float:
        """Toe, a uniform rod."""
        return self.toe_mass * self.toe_length**2 / 12

    # Load ---------------------------------------------------------------------------------------------------

    @property
    def carried_mass(self) -> float:
        """Mass of the load."""
        return self.carried_ratio * self.mass

    @property
    def carried_com(self) -> tuple[float, float]:
        """CoM of the load (forward of the hip, above the hip) along the trunk."""
        if self.carried_at == "waist":
            return 0.0, WAIST_ABOVE_HIP * self.length_scale
        return -CARRIED_BEHIND * self.length_scale, self.trunk_com_above_hip

    @property
    def carried_inertia(self) -> float:
        """Inertia of the load, with the radius of gyration `CARRIED_GYRATION`."""
        return self.carried_mass * (CARRIED_GYRATION[self.carried_at] * self.length_scale) ** 2

    @property
    def upper_moment(self) -> tuple[float, float]:
        """First mass moment of trunk and load about the hip (forward, up), along the trunk [kg m]."""
        forward, up = self.carried_com
        return self.carried_mass * forward, self.trunk_mass * self.trunk_com_above_hip + self.carried_mass * up

    @property
    def trunk_lean(self) -> float:
        """Forward pitch of the trunk [rad] that puts the CoM of trunk and load over the hip, as people lean."""
        forward, up = self.upper_moment
        return atan2(-forward, up)

    # Derived ------------------------------------------------------------------------------------------------

    def froude_speed(self, speed: float) -> float:
        """Return the dimensionless speed v / sqrt(g * leg_length) of `speed` [m/s]."""
        return speed / sqrt(GRAVITY * self.leg_length)
