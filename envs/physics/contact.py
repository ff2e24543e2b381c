"""Where a foot touches the ground, and how: spheres at heel, ball and toe tip.

Contact softness scales with the body as in `envs.physics.model`.
"""

from math import sqrt
from typing import TYPE_CHECKING

from springfoot.gait.body.body import HEEL_RADIUS, Body

from .timing import PHYSICS_STEP

if TYPE_CHECKING:
    import mujoco  # not at run time: settings read a constant here, and `--help` needs no simulator

CONTACTS = ("heel", "ball", "toe")
BALL_RADIUS, TOE_RADIUS = 0.02, 0.012
"""Radius [m] of the contact spheres at 1.70 m; chosen. The ball's is the height of the toe joint above the sole: its
sphere sits on that joint and belongs to the toe, so that heel-off neither rolls it nor drags the toe over the floor."""
FRICTION = 1.0
"""Coefficient of Coulomb friction between foot and ground [-]; chosen, as of rubber soles on a dry floor."""
FRICTION_TIME = 0.004
"""Time constant [s] in which sliding is stopped. MuJoCo leaves the change of the contact's Jacobian out of its
constraints, so a loaded foot slides at that acceleration times half of this: 2 cm/s at 15 ms."""
HEEL_CONTACT = {"solref": (0.02, 1.0), "solimp": (0.05, 0.95, 0.01)}
"""MuJoCo's contact of the heel pad at 1.70 m: time constant [s] and damping ratio [-]; impedance at zero and at full
depth [-], and that depth [m]. Chosen together with the leg constants, which were tuned on it: another pad needs another
tuning, or the heel strikes harder."""
SOLE_CONTACT = {"solref": (0.015, 1.0), "solimp": (0.9, 0.95, 0.003)}
"""The same of ball and toe, which are stiffer."""


def geom_name(contact: str, side: str) -> str:
    """Return the name of a foot's contact sphere, `contact` being one of `CONTACTS`."""
    return f"{contact}_{side}"


def ground_name(side: str) -> str:
    """Return the name of the ground below a foot: a plane, moved from outside (mocap)."""
    return f"ground_{side}"


def contact_offsets(body: Body) -> dict[str, tuple[float, float, float]]:
    """Return, for each of `CONTACTS`, its sphere's centre (forward, up) in the segment's frame, and radius [m].

    The heel is in the foot's frame (origin: ankle), ball and toe tip in the toe's frame (origin: toe joint).
    """
    heel, ball, toe = (radius * body.length_scale for radius in (HEEL_RADIUS, BALL_RADIUS, TOE_RADIUS))
    return {
        "heel": (heel - body.heel_to_ankle, heel - body.ankle_height, heel),
        "ball": (0.0, ball - body.toe_joint_height, ball),
        "toe": (body.toe_length - toe, toe - body.toe_joint_height, toe),
    }


def add_sphere(segment: "mujoco.MjsBody", name: str, offset: tuple[float, float, float]) -> None:
    """Add a sphere to a segment; it touches the ground of its foot (see `add_touch`) and nothing else."""
    import mujoco

    forward, up, radius = offset
    segment.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        pos=(forward, 0, up),
        size=(radius, 0, 0),
        contype=0,
        conaffinity=0,
        rgba=(0.85, 0.55, 0.25, 1.0),
    )


def add_touch(spec: "mujoco.MjSpec", contact: str, side: str, body: Body, friction: float) -> None:
    """Let the sphere `contact` of the foot of `side` touch the ground of that foot.

    The contact's softness scales with the body (time ~ sqrt(l), depth ~ l). It is an explicit pair because only a pair
    has a time constant of its own for friction.
    """
    kind = HEEL_CONTACT if contact == "heel" else SOLE_CONTACT
    time, ratio = kind["solref"]
    soft, hard, depth = kind["solimp"]
    time_scale = sqrt(body.length_scale)
    spec.add_pair(
        geomname1=ground_name(side),
        geomname2=geom_name(contact, side),
        condim=3,  # friction against sliding alone: the other three coefficients, MuJoCo's defaults, do not act
        friction=(friction, friction, 0.005, 0.0001, 0.0001),
        solref=(time * time_scale, ratio),
        solreffriction=(max(FRICTION_TIME * time_scale, 2.0 * PHYSICS_STEP), 1.0),
        solimp=(soft, hard, depth * body.length_scale, 0.5, 2.0),  # the last two are MuJoCo's defaults
    )
