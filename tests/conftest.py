"""A real browser for tests of pages; how to get one is the reason of the skip."""

import shutil

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")


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
