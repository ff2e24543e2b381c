"""Pictures of pages for the documents, by Playwright in the Chromium that is installed (extra `browser`).

python evaluate.py pretrained schedule --out runs/pages
python -m benchmarks.screenshots runs/pages/report.html docs/report.png
"""

import argparse
import shutil
from pathlib import Path

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
MOMENT = "each => { each.value = 270; each.dispatchEvent(new Event('input')) }"
"""Shortly after half of the first stride: the left foot pushes off."""


def main() -> None:
    """Take the picture of one page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("page", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--width", type=int, default=1280)
    parser.add_argument("--height", type=int, default=1400)
    parser.add_argument("--dark", action="store_true")
    words = parser.parse_args()
    from playwright.sync_api import sync_playwright  # pyright: ignore[reportMissingImports]

    with sync_playwright() as playwright:
        binary = next(filter(None, map(shutil.which, BROWSERS)), None)
        browser = playwright.chromium.launch(executable_path=binary, args=["--no-sandbox"])
        size = {"width": words.width, "height": words.height}
        scheme = "dark" if words.dark else "light"
        tab = browser.new_page(viewport=size, color_scheme=scheme)  # type: ignore[arg-type]
        tab.goto(words.page.resolve().as_uri())
        tab.locator("#scrub").evaluate(MOMENT)
        tab.screenshot(path=words.picture)
        browser.close()


if __name__ == "__main__":
    main()
