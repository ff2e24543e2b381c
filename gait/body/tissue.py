"""Compute joint loads without muscle activity: passive elastic moments of tissue, and the tendon of the calf.

Passive moments: Riener & Edrich, Journal of Biomechanics 32 (1999) 539-544, regressions over hip, knee and ankle angles
of ten subjects, here for 1.70 m and 63 kg.
"""

import numpy as np

from springfoot.arrays import NDArray

from .body import Body

TOE_STIFFNESS = 28.0
"""Stiffness of the toe joint under load [N m/rad] for 1.70 m and 63 kg; chosen, near the low end of barefoot estimates,
25 to 60, as the thesis has no number of its own."""
TENDON = 400.0
"""Stiffness of the Achilles tendon about the ankle [N m/rad] for 1.70 m and 63 kg: 190 N/mm (Lichtwark & Wilson, J.
Exp. Biol. 208 (2005) 4715-4725) at a lever of 46 mm."""


def passive_moments(body: Body, angle: NDArray) -> NDArray:
    """Return (..., 4) passive moments of hip, knee, ankle and toe [N m], extension and plantarflexion positive.

    `angle` (..., 4) [rad], flexion, dorsiflexion and toe up positive; the trunk is upright. The toe has
    `TOE_STIFFNESS` and rests in line with the foot.
    """
    hip, knee, ankle, _ = np.moveaxis(np.degrees(angle), -1, 0)
    of_hip = -np.exp(1.4655 - 0.0034 * knee - 0.0750 * hip) + np.exp(1.3403 - 0.0226 * knee + 0.0305 * hip) - 8.072
    of_knee = (
        -np.exp(1.800 + 0.0460 * ankle - 0.0352 * knee + 0.0217 * hip)
        + np.exp(-3.971 + 0.0004 * ankle + 0.0495 * knee - 0.0128 * hip)
        + 4.820
        - np.exp(2.220 - 0.150 * knee)
    )
    of_ankle = np.exp(2.1016 + 0.0843 * ankle - 0.0176 * knee)
    of_ankle -= np.exp(-7.9763 - 0.1949 * ankle + 0.0008 * knee) + 1.792
    of_toe = TOE_STIFFNESS * angle[..., 3]
    return body.stiffness_scale * np.stack([of_hip, of_knee, of_ankle, of_toe], -1)
