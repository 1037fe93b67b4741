"""Tables in Markdown."""

from rippletwin.learning.markdown import markdown_table


def test_a_table_has_a_row_for_each_line():
    assert markdown_table(["a", "b"], [(1, 2.5)]) == "| a | b |\n| --- | --- |\n| 1 | 2.5 |\n"


def test_content_cannot_end_its_cell():
    """A bar or a line break in a name would give a row more cells or break the table in two."""
    table = markdown_table(["a"], [("x|y",), ("two\nlines",)])
    assert table.splitlines()[2:] == ["| x\\|y |", "| two lines |"]


def test_a_table_without_lines_says_so():
    assert markdown_table(["a"], []) == "None.\n"
