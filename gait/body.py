"""The body: every length, mass, centre of mass and inertia from height and body mass.

Sources. Thesis: D. W. Nam, DGIST 2016, Table 1 (ratios of height). Winter: D. A. Winter, Biomechanics and
Motor Control of Human Movement, 4th ed. 2009, Table 4.1 (mass fractions, centres of mass, radii of gyration)
and Figure 4.1 (segment lengths). All ratios of masses are of body mass, all ratios of lengths of height unless said.
"""

from dataclasses import dataclass
from math import cos, hypot, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from .errors import require_within

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""

REFERENCE_HEIGHT = 1.70
"""Height [m] of the thesis's body; `length_scale` is 1 here."""
REFERENCE_MASS = 63.0
"""Mass [kg] of the thesis's body; `mass_scale` is 1 here."""

HEIGHT_RANGE = (1.0, 2.3)
"""Heights accepted [m]."""
MASS_RANGE = (20.0, 250.0)
"""Body masses accepted [kg]."""
BMI_RANGE = (10.0, 80.0)
"""Body-mass indices accepted [kg/m^2]."""


def gravity(slope: float) -> NDArray:
    """Acceleration of gravity (2,) [m/s^2] in a frame that leans with a `slope` [rad], uphill positive."""
    return -GRAVITY * np.array([sin(slope), cos(slope)])


@dataclass(frozen=True)
class Body:
    """A person of average proportions; properties in m, kg and kg m^2, one leg each.

    Inertias are sagittal, about the segment's own centre of mass (CoM). Raises `SpringfootError` for a body
    outside `HEIGHT_RANGE`, `MASS_RANGE` or `BMI_RANGE`.
    """

    height: float = REFERENCE_HEIGHT
    """Standing height [m]."""
    mass: float = REFERENCE_MASS
    """Body mass [kg]."""

    def __post_init__(self) -> None:
        require_within("height", self.height, HEIGHT_RANGE, "m")
        require_within("mass", self.mass, MASS_RANGE, "kg")
        require_within("body-mass index mass/height^2", self.mass / self.height**2, BMI_RANGE, "kg/m^2")

    # Scales against the reference body --------------------------------------------------------------------

    @property
    def length_scale(self) -> float:
        """height / 1.70 m."""
        return self.height / REFERENCE_HEIGHT

    @property
    def mass_scale(self) -> float:
        """mass / 63 kg."""
        return self.mass / REFERENCE_MASS

    @property
    def stiffness_scale(self) -> float:
        """Of stiffness and torque, at equal strain: mass scale x length scale."""
        return self.mass_scale * self.length_scale

    # Lengths ------------------------------------------------------------------------------------------------

    @property
    def heel_to_ankle(self) -> float:
        """Back of the heel to the ankle axis, along the sole (thesis l_bf)."""
        return 0.051 * self.height

    @property
    def ankle_to_toe_joint(self) -> float:
        """Ankle axis to toe joint, along the sole (thesis Table 1, appendix l_ft)."""
        return 0.061 * self.height

    @property
    def toe_length(self) -> float:
        """Toe joint to toe tip (thesis l_toe, from SizeKorea)."""
        return 0.04 * self.height

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
        """Toe joint above the sole: 2 cm at 1.70 m (half the thickness of the ball of the foot; design choice)."""
        return 0.02 * self.length_scale

    @property
    def shank_length(self) -> float:
        """Knee to ankle (thesis l_shank)."""
        return 0.245 * self.height

    @property
    def thigh_length(self) -> float:
        """Hip to knee (thesis l_thigh)."""
        return 0.245 * self.height

    @property
    def leg_length(self) -> float:
        """Hip above the floor when standing straight."""
        return self.thigh_length + self.shank_length + self.ankle_height

    @property
    def trunk_length(self) -> float:
        """Greater trochanter to glenohumeral joint, Winter's HAT (head, arms, trunk) segment (Figure 4.1)."""
        return 0.288 * self.height

    # Masses -------------------------------------------------------------------------------------------------

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
        """One foot without its toe: 80 % of Winter's foot (0.0145); the split is a design choice."""
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

    # Derived ------------------------------------------------------------------------------------------------

    def froude_speed(self, speed: float) -> float:
        """Dimensionless speed v / sqrt(g * leg_length) of `speed` [m/s]."""
        return speed / sqrt(GRAVITY * self.leg_length)
