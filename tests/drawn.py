"""What Matplotlib drew: tests look at the lines of a picture, not at the bytes of its file."""

from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray


@contextmanager
def kept_figures() -> Iterator[dict[str, Any]]:
    """Inside, every figure that is saved is also kept, by the name of its file; the files are written as ever."""
    kept: dict[str, Any] = {}

    def keep(figure: Figure, file: Any, *more: Any, **how: Any) -> None:
        if isinstance(file, (str, PathLike)):
            kept[Path(file).name] = figure
        return save(figure, file, *more, **how)

    save, patch = Figure.savefig, pytest.MonkeyPatch()
    patch.setattr(Figure, "savefig", keep)
    try:
        yield kept
    finally:
        patch.undo()


def has_line(axes: Any, x: ArrayLike, y: ArrayLike, rel: float = 1e-6) -> bool:
    """Whether one of the lines in the axes is this one, NaN where it is NaN."""
    wanted = np.stack([np.asarray(x, float), np.asarray(y, float)], -1)
    return any(_same(line.get_xydata(), wanted, rel) for line in axes.lines)


def _same(drawn: NDArray[Any], wanted: NDArray[Any], rel: float) -> bool:
    return drawn.shape == wanted.shape and np.allclose(drawn.astype(float), wanted, rtol=rel, atol=1e-9, equal_nan=True)
