"""Repeat every search for people who adapt to feet, by the commands kept beside their results.

    springfoot study adapt-all

A finished search does not run again: the command may be stopped and started anew.
"""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import tyro

from springfoot.errors import SpringfootError, require_count
from springfoot.files.markdown import table

from ..base.study import Answer, OnProgress, Study
from ..searches.constants_file import ADAPTED_FEET, read_feet
from .adapt import Adapt

PROGRAM = "springfoot study adapt"


@dataclass(frozen=True, kw_only=True)
class AdaptAll(Study):
    """Run all searches of a file of adapted feet into another one, and compare."""

    feet: Annotated[Path, tyro.conf.arg(metavar="FILE")] = ADAPTED_FEET
    """File of the commands to run, in its order."""
    to: Annotated[Path, tyro.conf.arg(metavar="FILE")] = Path("runs/feet/adapted.json")
    """File to write the results into; searches whose results it has are left out."""
    first: int | None = None
    """Only so many of them, from the first; all unless given."""

    QUICK: ClassVar[Mapping[str, Any]] = {"first": 1}
    UNIT: ClassVar[str] = " generations"

    def check(self) -> None:
        """Refuse a count below 1."""
        if self.first is not None:
            require_count("first", self.first)

    def ask(self, progress: OnProgress) -> Answer:
        """Search; with --quick for a moment, and no person is written."""
        known = read_feet(self.feet)
        lines = []
        for label, command in list(known["found_by"].items())[: self.first]:
            if read_feet(self.to)["found_by"].get(label) != command or self.quick:  # not yet finished there
                self._run(label, command, progress)
            foot_now = read_feet(self.to)["feet"].get(label)
            same = "same" if foot_now == known["feet"][label] else "other"
            lines.append([label, same, f"`{command}`"])
        return Answer(text=table(["foot", "as committed", "found by"], lines))

    def _run(self, label: str, command: str, progress: OnProgress) -> None:
        """Run the search `command` of the foot `label`, which writes its result into the file `to`."""
        if not command.startswith(f"{PROGRAM} "):
            raise SpringfootError(f"{self.feet}: {label} was found by no command of this study: {command:.60}")
        study = tyro.cli(Adapt, args=shlex.split(command.removeprefix(PROGRAM)), prog=PROGRAM)
        study = replace(study, feet=self.to, command=command, quick=self.quick)
        study = replace(study, **Adapt.QUICK) if self.quick else study
        study.check()
        self.to.parent.mkdir(parents=True, exist_ok=True)
        study.ask(progress)
