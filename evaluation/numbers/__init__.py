"""The one measurer of a gait: strides, curves over the stride, metrics and criteria."""
