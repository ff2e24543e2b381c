"""Fill the pages' templates: one style, one drawing script, and data that cannot end the script around it."""

import json
from collections.abc import Mapping
from importlib import resources
from typing import Any

SHARED = {"STYLE": "page.css", "DRAWING": "drawing.js"}
"""Mark in the pages -> file that replaces it."""


def filled(name: str, texts: Mapping[str, str]) -> str:
    """Return the page in the file `name`, its marks replaced: `/*MARK*/` by a shared file, `<!--MARK-->` by the text of
    that name in `texts`."""
    folder = resources.files("springfoot.evaluation.page")
    page = folder.joinpath(name).read_text(encoding="utf-8")
    for mark, file in SHARED.items():
        page = page.replace(f"/*{mark}*/\n", folder.joinpath(file).read_text(encoding="utf-8"))
    for mark, text in texts.items():
        page = page.replace(f"<!--{mark}-->", text)
    return page


def as_json(data: Any) -> str:
    """Return data as JSON that is safe inside a page's script: without `<`, which could end it."""
    return json.dumps(data, allow_nan=False, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")
