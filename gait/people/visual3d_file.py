"""Read the text that Visual3D exports: five lines of heads (file, name, type, folder, component), then rows of numbers.

`TIME` among the names makes a walk over time; 101 or 51 rows without it are mean curves over percent of the stride.
"""

from pathlib import Path

from springfoot.errors import SpringfootError
from springfoot.files.text_table import Table, make_table, text_lines

HEADS = 5
"""Lines before the numbers."""


def read_visual3d(path: Path) -> Table:
    """Return the columns of a text export of Visual3D, named by signal and component, such as `LKneeAngle X`.

    The first column is `percent`, or `item` if there is a time. Raises `SpringfootError` for a file of another form.
    """
    lines = [line.rstrip("\r\n").split("\t") for line in text_lines(path)]
    heads = lines[:HEADS]
    if len(heads) < HEADS or heads[4][0].strip().upper() != "ITEM" or len({len(head) for head in heads}) > 1:
        raise SpringfootError(
            f"{path.name} is no text of Visual3D: five lines of heads, of which the last begins with ITEM"
        )
    names = ["item"]
    for name, component in zip(heads[1][1:], heads[4][1:], strict=True):
        names.append("time_s" if name.strip().upper() == "TIME" else f"{name.strip()} {component.strip()}")
    rows = [cells for cells in lines[HEADS:] if any(cell.strip() for cell in cells)]
    if "time_s" not in names:
        names[0] = "percent"
        # The items count from 1: of 101 they are percents, of 51 every second one.
        step = 2 if len(rows) == 51 else 1
        rows = [[str(step * index), *cells[1:]] for index, cells in enumerate(rows)]
    return make_table(path.name, enumerate([names, *rows], HEADS))
