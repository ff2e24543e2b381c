"""Walking with segmented feet whose ankle and toe stiffness is learned.

Importing it registers the Gymnasium environment `springfoot/SegmentedFootBiped-v0`, also named `SegmentedFootBiped-v0`.
Each room is imported by its name:

- `springfoot.gait`: the science of walking;
- `springfoot.envs`: the walking body as Gymnasium environments;
- `springfoot.agents`: training, policies and baselines;
- `springfoot.evaluation`: how human a walk is;
- `springfoot.studies`: many walks held against each other.
"""

from gymnasium import register

__all__ = ["__version__"]

__version__ = "0.1.0.dev0"
"""Semantic version, as an installer sees it: pyproject.toml reads this line."""

for _id in ("springfoot/SegmentedFootBiped-v0", "SegmentedFootBiped-v0"):
    register(
        id=_id,
        entry_point="springfoot.envs.env:SegmentedFootBiped",
        vector_entry_point="springfoot.envs.vector_env:SegmentedFootBipedVector",
    )
