"""List the entries of the observation: names, units, bounds and meanings."""

from typing import NamedTuple

from ..physics.contact import CONTACTS
from ..physics.model import ACTIONS, JOINTS, PERSON_ACTIONS, SIDES

UNITS = ("1", "rad", "leg length", "sqrt(g l)", "sqrt(g/l)", "body weight")
"""Units of the entries; each entry is its SI value over its unit."""


class Entry(NamedTuple):
    """One entry of the observation."""

    name: str
    """Name."""
    unit: str
    """Unit, one of `UNITS`."""
    low: float
    """Lower bound, to which it is clipped."""
    high: float
    """Upper bound, to which it is clipped."""
    meaning: str
    """Meaning, in words."""
    measured: bool = True
    """True for measurements of a sensor, False for values of the controller."""


def _entries() -> tuple[Entry, ...]:
    """Return the entries in the order of the observation."""
    legs = [(side, joint) for side in SIDES for joint in JOINTS]
    sign: dict[str, str] = dict(zip(JOINTS, ("flexion", "flexion", "dorsiflexion", "toe up"), strict=True))
    return (
        Entry("hip_height", "leg length", 0.0, 2.0, "height of the hip"),
        Entry("pitch", "rad", -3.2, 3.2, "pitch of the trunk, forward positive"),
        *(Entry(f"{joint}_{side}", "rad", -3.2, 3.2, f"angle, {sign[joint]} positive") for side, joint in legs),
        Entry("hip_velocity_x", "sqrt(g l)", -5.0, 5.0, "velocity of the hip, forward positive"),
        Entry("hip_velocity_z", "sqrt(g l)", -5.0, 5.0, "velocity of the hip, up positive"),
        Entry("pitch_rate", "sqrt(g/l)", -15.0, 15.0, "rate of the pitch, forward positive"),
        *(
            Entry(f"{joint}_rate_{side}", "sqrt(g/l)", -15.0, 15.0, f"angular rate, {sign[joint]} positive")
            for side, joint in legs
        ),
        Entry("phase_sin", "1", -1.0, 1.0, "sine of 2 pi x left stride phase", False),
        Entry("phase_cos", "1", -1.0, 1.0, "cosine of 2 pi x left stride phase", False),
        Entry("phase_sin_2", "1", -1.0, 1.0, "sine of 4 pi x left stride phase", False),
        Entry("phase_cos_2", "1", -1.0, 1.0, "cosine of 4 pi x left stride phase", False),
        *(
            Entry(
                f"load_{contact}_{side}",
                "body weight",
                0.0,
                5.0,
                "vertical force, mean of the step",
            )
            for side in SIDES
            for contact in CONTACTS
        ),
        Entry("com_x_error", "leg length", -2.0, 2.0, "CoM minus plan, forward positive"),
        Entry("com_z_error", "leg length", -2.0, 2.0, "CoM minus plan, up positive"),
        Entry("speed_error", "sqrt(g l)", -5.0, 5.0, "forward speed of the CoM minus plan"),
        *(Entry(f"last_action_{name}", "1", -1.0, 1.0, "action of the step before", False) for name in ACTIONS),
        *(
            Entry(f"planned_ankle_{side}", "rad", -3.2, 3.2, "target's ankle angle at the leg's phase", False)
            for side in SIDES
        ),
        Entry("leading_leg", "1", -1.0, 1.0, "stance that began last: +1 left, -1 right", False),
        Entry("command_speed", "sqrt(g l)", 0.0, 2.0, "commanded speed (Froude speed)", False),
        Entry("height_ratio", "1", 0.0, 2.0, "height / 1.70 m", False),
    )


def _person_entries() -> tuple[Entry, ...]:
    """Return the entries that only a person observes, in order: last offsets, slope, stiffness, feet, body, step,
    and the speed that it holds."""
    springs = [(side, joint) for side in SIDES for joint in ("ankle", "toe")]
    return (
        *(Entry(f"last_{name}", "rad", -1.0, 1.0, "offset of the step before", False) for name in PERSON_ACTIONS),
        Entry("own_stiffness", "1", 0.0, 1.0, "1 where the action sets the stiffness, else 0", False),
        Entry("slope", "rad", -0.2, 0.2, "slope of the ground, uphill positive", False),
        *(
            Entry(f"stiffness_{joint}_{side}", "1", -6.0, 6.0, "log of K over 300 (ankle), 60 N m/rad (toe)", False)
            for side, joint in springs
        ),
        *(entry for side in SIDES for entry in _worn_entries(side)),
        Entry("leg_ratio", "1", 0.0, 2.0, "leg length over the average at that height", False),
        Entry("foot_ratio", "1", 0.0, 2.0, "foot length over the average at that height", False),
        Entry("carried_ratio", "1", 0.0, 2.0, "load over body mass", False),
        Entry("planned_step", "leg length", 0.0, 2.0, "step length of the plan", False),
        Entry("held_speed_error", "sqrt(g l)", -5.0, 5.0, "mean speed of 0.7 s minus the commanded one"),
        Entry("aim", "sqrt(g l)", -1.0, 1.0, "speed that it aims at beyond the commanded one", False),
    )


def _worn_entries(side: str) -> tuple[Entry, ...]:
    """Return the entries of the foot on one side, left or right; `envs.task.worn` computes their values."""
    return (
        Entry(f"muscles_ankle_{side}", "1", 0.0, 1.0, "1 for muscles, 0 for a device in their place", False),
        Entry(f"muscles_toe_{side}", "1", 0.0, 1.0, "likewise", False),
        Entry(f"strength_{side}", "1", 0.0, 1.0, "strength of the plantarflexors, 1 for sound ones", False),
        Entry(f"acts_in_swing_{side}", "1", 0.0, 1.0, "0 for a drop foot, else 1", False),
        Entry(f"device_rest_ankle_{side}", "rad", -1.0, 1.0, "rest angle of the ankle's device", False),
        Entry(f"device_rest_toe_{side}", "rad", -1.0, 1.0, "rest angle of the toe's device", False),
        Entry(f"brace_ankle_{side}", "1", 0.0, 9.0, "K of the orthosis over 300 N m/rad", False),
        Entry(f"brace_toe_{side}", "1", 0.0, 9.0, "K of the orthosis over 60 N m/rad", False),
        Entry(f"brace_low_{side}", "rad", -1.0, 1.0, "lowest ankle angle at which the orthosis is slack", False),
        Entry(f"brace_high_{side}", "rad", -1.0, 1.0, "highest such angle", False),
        Entry(
            f"added_mass_{side}", "1", -0.2, 0.2, "mass below the knee beyond the intact one's, over body mass", False
        ),
    )


OBSERVATION = _entries()
"""Every entry of the observation, in order. l is the leg length (hip to floor when standing); the weight is that of
body and load. No entry shows the mass of the body, as mechanics scale with it (`envs.physics.model`)."""
PERSON_OBSERVATION = OBSERVATION + _person_entries()
"""Every entry of the observation where the action moves the person: `OBSERVATION`, and the entries of a person.
Stiffness is over that unit at 1.70 m and 63 kg, scaled with mass x height; `aim` follows the setting `aim_rate`."""


def entries_of(acts: str) -> tuple[Entry, ...]:
    """Return the entries of the observation with the setting `acts`."""
    return OBSERVATION if acts == "stiffness" else PERSON_OBSERVATION
