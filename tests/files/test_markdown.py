"""Markdown tables, and text as HTML."""

from springfoot.files.markdown import html_of, table, text_of


def test_tables_say_what_is_missing():
    assert table(["a", "b"], [["1", text_of(None, ".2f")]]) == "| a | b |\n| --- | --- |\n| 1 | – |"


def test_text_becomes_html_without_any_of_its_own():
    text = f"**Least with <4>** & more.\n\n{table(['', 'b'], [['x<y', '1'], ['', '**2**']])}\n\n- one\n- two"
    assert html_of(text).splitlines() == [
        "<p><strong>Least with &lt;4&gt;</strong> &amp; more.</p>",
        '<table><thead><tr><th scope="col"></th><th scope="col">b</th></tr></thead>'
        '<tbody><tr><th scope="row">x&lt;y</th><td>1</td></tr>'
        '<tr><th scope="row"></th><td><strong>2</strong></td></tr></tbody></table>',
        "<ul><li>one</li><li>two</li></ul>",
    ]
    assert html_of("| no table\n\n\n<script>") == "<p>| no table</p>\n<p>&lt;script&gt;</p>"
