"""Sections of a page: each command writes its own and leaves the rest alone."""

import pytest

from springfoot.files.markdown import table, text_of, write_section
from springfoot.gait import SpringfootError


def test_sections_are_made_replaced_and_kept_apart(tmp_path):
    page = tmp_path / "page.md"
    write_section(page, "ONE", "first\n")
    write_section(page, "TWO", "second")
    write_section(page, "ONE", "changed")
    assert page.read_text() == (
        "<!-- ONE BEGIN -->\nchanged\n<!-- ONE END -->\n\n<!-- TWO BEGIN -->\nsecond\n<!-- TWO END -->\n"
    )


@pytest.mark.parametrize("text", ["<!-- ONE BEGIN -->", "<!-- ONE END --><!-- ONE BEGIN -->", 2 * "<!-- ONE END -->"])
def test_a_page_with_odd_markers_is_refused_and_stays(tmp_path, text):
    page = tmp_path / "page.md"
    page.write_text(text)
    with pytest.raises(SpringfootError, match="once each"):
        write_section(page, "ONE", "new")
    assert page.read_text() == text


def test_tables_say_what_is_missing():
    assert table(["a", "b"], [["1", text_of(None, ".2f")]]) == "| a | b |\n| --- | --- |\n| 1 | – |"
