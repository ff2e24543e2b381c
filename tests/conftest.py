"""One thread for torch, kernels compiled before the tests begin; and a real browser for tests of pages, or why not."""

import os
import shutil
import subprocess
import sys

import pytest

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before torch is imported: two threads take ten times as long for SAC
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
COMPILE = """
from springfoot.envs import SegmentedFootBipedVector

for settings in (
    {"start": "standing", "left_foot": "passive"},
    {"speed_range": (1.0, 1.4), "speed_interval": 1.0, "decisions": "event"},
):
    environments = SegmentedFootBipedVector(num_envs=2, **settings)
    environments.reset(seed=0)
    for _ in range(150):
        environments.step(environments.action_space.sample())
"""
"""A program that calls every kernel, so that numba has them all in its cache."""


compiling: list[subprocess.Popen] = []
"""The process that compiles the kernels, as long as it is not awaited."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes():
    """Begin to compile the kernels once: each of pytest-xdist's workers, which collect tests meanwhile, would."""
    compiling.append(subprocess.Popen([sys.executable, "-c", COMPILE]))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_node_collection_finished():
    """Give no worker a test before the kernels are compiled; what fails there fails in the tests."""
    while compiling:
        compiling.pop().wait()


@pytest.fixture(scope="module")
def chromium():
    """Debian's Chromium, driven by Playwright; it draws WebGL in software."""
    how = "needs a browser: pip install playwright, and Debian's chromium (apt install chromium)"
    driver = pytest.importorskip("playwright.sync_api", reason=how)
    binary = next(filter(None, map(shutil.which, BROWSERS)), None)
    if binary is None:
        pytest.skip(how)
    with driver.sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=binary, args=["--no-sandbox", "--enable-unsafe-swiftshader"]
        )
        yield browser
        browser.close()
