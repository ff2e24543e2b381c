"""Train policies in a study, and keep them in a folder, so that a stopped study goes on."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

import tyro

from springfoot.agents.training import Engine, TrainingConfig, train_missing
from springfoot.errors import require_count

from .study import WalkingStudy


@dataclass(frozen=True, kw_only=True)
class TrainingStudy(WalkingStudy):
    """A study of trainings; finished seeds are not trained again."""

    runs: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("runs/trainings")
    """Folder of all trainings; finished ones are kept."""
    seeds: int = 3
    """Seeds of each training, 0 and the next ones."""
    timesteps: int | None = None
    """Steps of 20 ms of each training, the preset's unless given."""
    engine: Engine = "here"
    """Where missing seeds are trained: in processes on this machine, or on a Ray cluster (extra `rllib`) whose nodes
    share the folder of the trainings."""
    train: bool = True
    """Train missing seeds; without, use the finished ones."""

    QUICK: ClassVar[dict[str, Any]] = {**WalkingStudy.QUICK, "seeds": 1, "timesteps": 8192}

    def check(self) -> None:
        """Refuse counts out of range."""
        super().check()
        require_count("seeds", self.seeds)
        if self.timesteps is not None:
            require_count("timesteps", self.timesteps)

    def train_missing(self, jobs: Sequence[tuple[TrainingConfig, Path, str]]) -> bool:
        """Train the `jobs` (configuration, folder, name) that are not finished; return True if a training failed.

        Raises `KeyboardInterrupt` if the user stopped it.
        """
        status = train_missing(jobs, self.engine) if self.train else "finished"
        if status == "interrupted":
            raise KeyboardInterrupt
        return status == "failed"
