"""Name the extra of springfoot that installs a missing package."""

from collections.abc import Iterator
from contextlib import contextmanager

EXTRA_OF = {
    "PIL": "evaluate",
    "axe_playwright_python": "browser",
    "cma": "train",
    "ezc3d": "c3d",
    "h5py": "minari",
    "imageio_ffmpeg": "film",
    "matplotlib": "evaluate",
    "minari": "minari",
    "onnx": "onnx",
    "onnxruntime": "onnx",
    "playwright": "browser",
    "pyarrow": "parquet",
    "ray": "rllib",
    "rich": "evaluate",
    "stable_baselines3": "train",
    "tensorboard": "train",
    "tensorboardX": "rllib",
    "torch": "train",
    "tqdm": "evaluate",
    "trimesh": "live",
    "typeguard": "evaluate",
    "tyro": "evaluate",
    "viser": "live",
}
"""Name in an import statement -> extra."""


@contextmanager
def naming_extras() -> Iterator[None]:
    """Add the extra to install to the error of a missing package, for imports inside the block."""
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name not in EXTRA_OF:
            raise
        advice = f"the package {error.name} is missing: pip install 'springfoot[{EXTRA_OF[error.name]}]'"
        raise ModuleNotFoundError(advice, name=error.name) from None
