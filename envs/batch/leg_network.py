"""Compute a mirrored network of tanh layers for both legs of each body, in single precision as it was trained.

A person walks by it inside the step, and a policy of this form acts by it (`springfoot.agents.policies.policy`). Both
legs pass through a layer together, so that each weight is read once. The sums run in one order for any number of
bodies, and the same for both legs: the bits depend neither on the batch nor on the side.
"""

from collections.abc import Sequence

import numpy as np

from springfoot.arrays import NDArray

from ..physics.kernel import kernel, part
from ..physics.model import SIDES
from ..task.mirror import Mirror

LARGEST_INPUT = 1e20
"""Largest magnitude of a normalised entry [-]; chosen: sums of products with weights stay finite in single
precision."""
_FARTHEST = np.float32(7.905311)
"""Largest magnitude for which the fraction holds; it is 1 there."""
_P1, _P3, _P5, _P7, _P9, _P11, _P13 = (
    np.float32(number)
    for number in (
        4.89352455891786e-03,
        6.37261928875436e-04,
        1.48572235717979e-05,
        5.12229709037114e-08,
        -8.60467152213735e-11,
        2.00018790482477e-13,
        -2.76076847742355e-16,
    )
)
"""Odd coefficients of the numerator of tanh; Eigen 3.4, `Eigen/src/Core/MathFunctionsImpl.h`."""
_Q0, _Q2, _Q4, _Q6 = (
    np.float32(number)
    for number in (4.89352518554385e-03, 2.26843463243900e-03, 1.18534705686654e-04, 1.19825839466702e-06)
)
"""Even coefficients of its denominator; the same source."""


@part
def _tanh(values) -> None:
    """Replace `values` (N,) by their tanh, within 4e-7: a fraction of polynomials, which a processor computes for
    several numbers at once."""
    for k in range(len(values)):
        x = min(max(values[k], -_FARTHEST), _FARTHEST)
        xx = x * x
        above = _P1 + xx * (_P3 + xx * (_P5 + xx * (_P7 + xx * (_P9 + xx * (_P11 + xx * _P13)))))
        below = _Q0 + xx * (_Q2 + xx * (_Q4 + xx * _Q6))
        values[k] = x * above / below


@part
def _layer(weight, bias, left, right, left_output, right_output) -> None:
    """Fill the outputs (outputs,) of each leg: `bias` plus the products of its inputs (inputs,) with `weight` (inputs,
    outputs), four inputs at a time."""
    inputs, outputs = weight.shape
    for k in range(outputs):
        left_output[k] = right_output[k] = bias[k]
    fours = inputs - inputs % 4
    for j in range(0, fours, 4):
        a, b, c, d = left[j], left[j + 1], left[j + 2], left[j + 3]
        e, f, g, h = right[j], right[j + 1], right[j + 2], right[j + 3]
        for k in range(outputs):
            p, q, r, s = weight[j, k], weight[j + 1, k], weight[j + 2, k], weight[j + 3, k]
            left_output[k] = left_output[k] + a * p + b * q + c * r + d * s
            right_output[k] = right_output[k] + e * p + f * q + g * r + h * s
    for j in range(fours, inputs):
        for k in range(outputs):
            left_output[k] += left[j] * weight[j, k]
            right_output[k] += right[j] * weight[j, k]


@kernel
def _act(observation, acting, mean, deviation, clip, index, sign, weights, biases, actions) -> None:
    """Fill the actions of the bodies `acting` (N,): the outputs of the network for each leg, clipped to [-1, 1].

    Args:
        observation: (N, D) float32.
        acting: (N,) bool; the actions of other bodies stay.
        mean, deviation: (D,) of the observations in training.
        clip: largest magnitude of a normalised entry.
        index, sign: (D,) of the mirror image, see `springfoot.envs.task.mirror`.
        weights: of each layer, (inputs, outputs) float32.
        biases: of each layer, (outputs,) float32.
        actions: (N, side, A/2).
    """
    entries = len(mean)
    for i in range(len(observation)):
        if not acting[i]:
            continue
        legs = np.empty((2, entries), np.float32)
        for k in range(entries):
            seen = (observation[i, k] - mean[k]) / deviation[k]
            image = (observation[i, index[k]] * sign[k] - mean[k]) / deviation[k]
            legs[0, k] = min(max(seen, -clip), clip)
            legs[1, k] = min(max(image, -clip), clip)
        for layer in range(len(weights)):
            outputs = np.empty((2, len(biases[layer])), np.float32)
            _layer(weights[layer], biases[layer], legs[0], legs[1], outputs[0], outputs[1])
            if layer < len(weights) - 1:  # activations stand between the layers
                _tanh(outputs[0])
                _tanh(outputs[1])
            legs = outputs
        for side in range(2):
            for k in range(actions.shape[2]):
                actions[i, side, k] = min(max(legs[side, k], -1.0), 1.0)


class LegNetwork:
    """A mirrored network of tanh layers; its outputs, clipped to [-1, 1], are the actions of a leg.

    Args:
        mean, deviation: (D,) of the observations in training; no deviation is 0.
        clip: largest magnitude of a normalised observation; None for no limit.
        mirror: of its observations.
        weights: of each layer, (outputs, inputs).
        biases: of each layer, (outputs,).
    """

    def __init__(
        self,
        mean: NDArray,
        deviation: NDArray,
        clip: float | None,
        mirror: Mirror,
        weights: Sequence[NDArray],
        biases: Sequence[NDArray],
    ) -> None:
        self._numbers = (
            mean.astype(float),
            deviation.astype(float),
            LARGEST_INPUT if clip is None else min(float(clip), LARGEST_INPUT),
            mirror.index,
            mirror.sign.astype(float),
            tuple(np.ascontiguousarray(weight.T, np.float32) for weight in weights),
            tuple(bias.astype(np.float32) for bias in biases),
        )
        self._outputs = len(biases[-1])

    def __call__(self, observation: NDArray, acting: NDArray) -> NDArray:
        """Return the actions (N, side, A/2) for observations (N, D) float32, those of the right leg as their images on
        the left; 0 for bodies that are not `acting` (N,)."""
        actions = np.zeros((len(observation), len(SIDES), self._outputs), np.float32)
        _act(observation, acting, *self._numbers, actions)
        return actions
