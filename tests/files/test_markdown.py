"""Markdown tables."""

from springfoot.files.markdown import table, text_of


def test_tables_say_what_is_missing():
    assert table(["a", "b"], [["1", text_of(None, ".2f")]]) == "| a | b |\n| --- | --- |\n| 1 | – |"
