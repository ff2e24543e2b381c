"""Name the extra of springfoot that installs a missing package."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

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
_INSTALLED_AS = {"rsl_rl": "rsl-rl-lib", "sb3_contrib": "sb3-contrib"}
"""Name in an import statement -> name to install, of packages in no extra, where they differ."""


@contextmanager
def naming_extras() -> Iterator[None]:
    """Add the extra to install to the error of a missing package, for imports inside the block."""
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name not in EXTRA_OF:
            raise
        raise ModuleNotFoundError(missing(error.name), name=error.name) from None


@contextmanager
def exiting_if_missing() -> Iterator[None]:
    """End a program, with one line on standard error and exit code 2, if a package that it imports inside the block is
    missing."""
    try:
        yield
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package in ("", "springfoot"):
            raise
        print(f"{Path(sys.argv[0]).name}: error: {missing(package)}", file=sys.stderr)
        sys.exit(2)


def missing(package: str, extra: str = "") -> str:
    """Return the message on a missing package, with the command that installs it: `extra` or else its own extra of
    springfoot, and the package itself if it is in none."""
    extra = extra or EXTRA_OF.get(package, "")
    return f"the package {package} is missing: pip install " + (
        f"'springfoot[{extra}]'" if extra else _INSTALLED_AS.get(package, package)
    )
