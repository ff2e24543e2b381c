"""Walking with segmented feet whose ankle and toe stiffness is learned.

Importing it registers the Gymnasium environment `springfoot/SegmentedFootBiped-v0`, also named `SegmentedFootBiped-v0`,
and the frozen tasks of `springfoot.tasks`, such as `springfoot/Walk-v0`.
Each room is imported by its name:

- `springfoot.gait`: the science of walking;
- `springfoot.envs`: the walking body as Gymnasium environments;
- `springfoot.agents`: training, policies and baselines;
- `springfoot.evaluation`: how human a walk is;
- `springfoot.studies`: many walks held against each other.
"""

from gymnasium import register

from springfoot.tasks import TASKS

__all__ = ["__version__"]

__version__ = "0.1.0.dev0"
"""Semantic version, as an installer sees it: pyproject.toml reads this line."""

_ENVIRONMENTS = {"springfoot/SegmentedFootBiped-v0": {}, "SegmentedFootBiped-v0": {}}
_ENVIRONMENTS |= {f"springfoot/{name}": settings for name, settings in TASKS.items()}
for _id, _settings in _ENVIRONMENTS.items():
    register(
        id=_id,
        entry_point="springfoot.envs.env:SegmentedFootBiped",
        vector_entry_point="springfoot.envs.vector_env:SegmentedFootBipedVector",
        kwargs=_settings,
    )
