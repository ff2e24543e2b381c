"""Compute joint loads without muscle activity: passive elastic moments of tissue, and the tendons of calf and toes.

Passive moments: Riener & Edrich, Journal of Biomechanics 32 (1999) 539-544, regressions over hip, knee and ankle angles
of ten subjects, here for 1.70 m and 63 kg.
"""

from typing import Any

import numpy as np

from springfoot.arrays import NDArray

from .body import Body

TOE_STIFFNESS = 28.0
"""Stiffness of the toe joint under load [N m/rad] for 1.70 m and 63 kg; chosen, near the low end of barefoot estimates,
25 to 60, as the thesis has no number of its own."""
ANKLE_TENDON = 400.0
"""Stiffness of the Achilles tendon about the ankle [N m/rad] for 1.70 m and 63 kg: 190 N/mm (Lichtwark & Wilson, J.
Exp. Biol. 208 (2005) 4715-4725) at a lever of 46 mm."""


TOE_TENDON = 25.0
"""Stiffness of the tendons of the toes' flexors about the toe joint [N m/rad] at their largest force, for 1.70 m and 63
kg: forces and tendon lengths of three flexors of D'Hondt et al., PLoS Comput. Biol. 20 (2024) e1012219 (model
`DHondt_et_al_2024_4seg.osim`) at a lever of 9.5 mm. At a fifth of that force it is 9, at half of it 16; walks here
reach and pass the largest force."""
FASCIA = (5.6, 1.38)
"""Passive moment of the toe [N m] at 1.70 m and 63 kg, first x (exp(second x angle [rad]) - 1): the plantar fascia of
Natali et al. (2010) in the same model, round a head of 9.5 mm. Chosen: 0.6 of the moment with a rigid arch, as the
arch rises; the whole would be a plausible upper end, 0.3 of it a lower."""
TENDON_SHARE = 0.9
"""Largest stiffness of a muscle with its tendon over that of the tendon [-]; chosen: the muscle's own is then nine
times the tendon's. Muscle and tendon in series are always softer than the tendon."""
RELAXED_STIFFNESS = 36.0
"""Stiffness of a relaxed calf about the ankle [N m/rad] for 1.70 m and 63 kg: 13 % of the load's toppling torque
an angle (Loram, Maganaris & Lakie, J. Physiol. 584 (2007) 677-692)."""
STIFFNESS_PER_TORQUE = 5.0
"""Rise of a muscle's stiffness with its torque [1/rad]; chosen. That it is proportional is Weiss, Hunter & Kearney's,
J. Biomech. 21 (1988) 539-544; readings of the slope lie between 2.5 and 14."""
_PER_RADIAN = 180.0 / np.pi


def passive_moments(body: Body, angle: NDArray) -> NDArray:
    """Return (..., 4) passive moments of hip, knee, ankle and toe [N m], extension and plantarflexion positive.

    `angle` (..., 4) [rad], flexion, dorsiflexion and toe up positive; the trunk is upright.
    """
    return body.strength_scale * np.stack(tissue_moments(*np.moveaxis(angle, -1, 0)), -1)


def tissue_moments(hip: Any, knee: Any, ankle: Any, toe: Any) -> Any:
    """Return the passive moments of hip, knee, ankle and toe [N m] at 1.70 m and 63 kg, signs as in `passive_moments`.

    The angles [rad] are numbers or arrays: the environment's kernels compile this function.
    """
    hip = _PER_RADIAN * hip
    knee = _PER_RADIAN * knee
    ankle = _PER_RADIAN * ankle
    of_hip = -np.exp(1.4655 - 0.0034 * knee - 0.0750 * hip) + np.exp(1.3403 - 0.0226 * knee + 0.0305 * hip) - 8.072
    of_knee = (
        -np.exp(1.800 + 0.0460 * ankle - 0.0352 * knee + 0.0217 * hip)
        + np.exp(-3.971 + 0.0004 * ankle + 0.0495 * knee - 0.0128 * hip)
        + 4.820
        - np.exp(2.220 - 0.150 * knee)
    )
    of_ankle = (
        np.exp(2.1016 + 0.0843 * ankle - 0.0176 * knee) - np.exp(-7.9763 - 0.1949 * ankle + 0.0008 * knee) - 1.792
    )
    return of_hip, of_knee, of_ankle, FASCIA[0] * (np.exp(FASCIA[1] * toe) - 1.0)


def ankle_tissue_stiffness(knee: Any, ankle: Any) -> Any:
    """Return the stiffness of the ankle's passive tissue [N m/rad] at 1.70 m and 63 kg, the slope of `tissue_moments`.

    The angles [rad] are numbers or arrays.
    """
    knee = _PER_RADIAN * knee
    ankle = _PER_RADIAN * ankle
    rising = 0.0843 * np.exp(2.1016 + 0.0843 * ankle - 0.0176 * knee)
    return _PER_RADIAN * (rising + 0.1949 * np.exp(-7.9763 - 0.1949 * ankle + 0.0008 * knee))


def charged_calf_stiffness(
    stiffness: Any, tissue: Any, torque: Any, tendon: float, scale: float, per_torque: float = STIFFNESS_PER_TORQUE
) -> Any:
    """Return the stiffness of the calf muscle beyond that of a relaxed calf and that which its torque brings [N m/rad],
    at least 0.

    The muscle is in series with its tendon, and both are beside passive tissue: K of the ankle less that of the tissue
    is that of muscle and tendon. Arguments are numbers, as in kernels, or arrays.

    Args:
        stiffness, tissue: K of the whole ankle, and of its tissue [N m/rad].
        torque: of the calf [N m].
        tendon: stiffness of the tendon at 1.70 m and 63 kg [N m/rad].
        scale: factor on the stiffness of tendon and relaxed calf for this body, `Body.strength_scale` [-].
        per_torque: rise of the calf's stiffness with its torque [1/rad].
    """
    # Calf and tendon alone: K may be below the tissue's, and the angles have moved on since it was bounded.
    together = np.minimum(np.maximum(stiffness - tissue, 0.0), TENDON_SHARE * scale * tendon)
    own = together * (scale * tendon) / (scale * tendon - together)
    return np.maximum(own - scale * RELAXED_STIFFNESS - per_torque * np.abs(torque), 0.0)
