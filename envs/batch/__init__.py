"""The batched walk: N bodies stepped at once, the kernels of a step, its result and its exact state."""
