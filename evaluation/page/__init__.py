"""Write the pages that a browser opens offline: report.html and play.html."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .page_figure import foot_words
    from .play import Grid, play_page
    from .play_data import episodes_of
    from .report_page import PAGE_PACKAGES, write_page

__all__ = ["PAGE_PACKAGES", "Grid", "episodes_of", "foot_words", "play_page", "write_page"]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "PAGE_PACKAGES": "report_page",
            "Grid": "play",
            "episodes_of": "play_data",
            "foot_words": "page_figure",
            "play_page": "play",
            "write_page": "report_page",
        },
    )
