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


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes():
    """Compile the kernels once, before pytest-xdist starts its workers: each would compile all of them."""
    subprocess.run([sys.executable, "-c", COMPILE], check=False)  # what fails here fails in the tests


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
