"""How often a browser draws `springfoot live`: Playwright, in a Chromium that is installed (extras `browser`, `live`).

    python -m benchmarks.live_pictures

Without a GPU Chromium draws by SwiftShader, on the processor that also walks. A picture counts where WebGL was asked to
draw something between two frames of the browser.
"""

import argparse
import os
import shutil
import threading
import time

from springfoot.evaluation.live.steered_walk import LiveSession
from springfoot.evaluation.live.view import LiveView

from .screenshots import BROWSERS

COUNT = """
window.drawn = 0; let asked = false;
for (const name of ["drawElements", "drawArrays", "drawElementsInstanced", "drawArraysInstanced"]) {
  const draw = WebGL2RenderingContext.prototype[name];
  WebGL2RenderingContext.prototype[name] = function (...words) { asked = true; return draw.apply(this, words); };
}
(function next() { window.drawn += asked; asked = false; requestAnimationFrame(next); })();
"""
WARM = 10.0
"""Before counting [s]: the page loads and compiles its shaders."""


def main() -> None:
    """Count for a while, and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--policy", default="pretrained")
    parser.add_argument("--width", type=int, default=1280)
    parser.add_argument("--height", type=int, default=720)
    parser.add_argument("--seconds", type=float, default=20.0)
    words = parser.parse_args()
    from playwright.sync_api import sync_playwright  # pyright: ignore[reportMissingImports]

    session = LiveSession(words.policy)
    view = LiveView(session, port=0)
    ended = threading.Event()
    walker = threading.Thread(target=lambda: [view.run(0.2) for _ in iter(ended.is_set, True)])
    walker.start()
    with sync_playwright() as playwright:
        binary = next(filter(None, map(shutil.which, BROWSERS)), None)
        browser = playwright.chromium.launch(executable_path=binary, args=["--no-sandbox"])
        tab = browser.new_page(viewport={"width": words.width, "height": words.height})
        tab.add_init_script(COUNT)
        tab.goto(view.address)
        tab.get_by_text("K that acts").wait_for(timeout=60_000)
        tab.wait_for_timeout(1000 * WARM)
        begin = time.perf_counter(), tab.evaluate("drawn"), view.frames
        tab.wait_for_timeout(1000 * words.seconds)
        end = time.perf_counter(), tab.evaluate("drawn"), view.frames
        browser.close()
    ended.set()
    walker.join()
    view.stop()
    wall, drawn, steps = (after - before for before, after in zip(begin, end, strict=True))
    print(
        f"{words.width} x {words.height}: {drawn / wall:.1f} pictures/s drawn; the walk took "
        f"{steps * session.dt / wall:.2f} s a second; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors"
    )


if __name__ == "__main__":
    main()
