"""The body: lengths, masses and inertias, the mechanics of a leg, passive tissue, and rolling feet."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .body import GRAVITY, HEEL_RADIUS, REFERENCE_HEIGHT, REFERENCE_MASS, Body
    from .tissue import ANKLE_TENDON, TOE_STIFFNESS

__all__ = ["ANKLE_TENDON", "GRAVITY", "HEEL_RADIUS", "REFERENCE_HEIGHT", "REFERENCE_MASS", "TOE_STIFFNESS", "Body"]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "ANKLE_TENDON": "tissue",
            "GRAVITY": "body",
            "HEEL_RADIUS": "body",
            "REFERENCE_HEIGHT": "body",
            "REFERENCE_MASS": "body",
            "TOE_STIFFNESS": "tissue",
            "Body": "body",
        },
    )
