"""Write the pages that a browser opens offline: report.html and walks.html."""

from typing import TYPE_CHECKING

from springfoot.lazy import lazy_names

if TYPE_CHECKING:
    from .page_figure import foot_words
    from .report_page import PAGE_PACKAGES, write_page
    from .walks import Grid, Walk, walk_of, walks_page

__all__ = ["PAGE_PACKAGES", "Grid", "Walk", "foot_words", "walk_of", "walks_page", "write_page"]

if not TYPE_CHECKING:  # a type checker would take it to mean that any name exists
    __getattr__ = lazy_names(
        __name__,
        {
            "PAGE_PACKAGES": "report_page",
            "Grid": "walks",
            "Walk": "walks",
            "foot_words": "page_figure",
            "walk_of": "walks",
            "walks_page": "walks",
            "write_page": "report_page",
        },
    )
