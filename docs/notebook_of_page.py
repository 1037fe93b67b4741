"""Make docs/how-to/notebook.ipynb from docs/how-to/notebook.md: Python blocks become code cells.

python docs/notebook_of_page.py
"""

from __future__ import annotations

import json
import re
from pathlib import Path

PAGE = Path(__file__).resolve().parent / "how-to" / "notebook.md"
NOTEBOOK = PAGE.with_suffix(".ipynb")


def cells(page: str) -> list[dict]:
    """Cells of format 4.5; between two blocks of Python all text is one cell."""
    found = []
    for k, part in enumerate(re.split(r"^```python\n(.*?)^```\n", page, flags=re.M | re.S)):
        if not part.strip():
            continue
        cell = {"id": f"cell-{k}", "metadata": {}, "source": part.strip().splitlines(keepends=True)}
        if k % 2:
            cell |= {"cell_type": "code", "execution_count": None, "outputs": []}
        else:
            cell |= {"cell_type": "markdown"}
        found.append(cell)
    return found


def notebook(page: str) -> str:
    """The notebook as text, the same for the same page."""
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    content = {
        "cells": cells(page),
        "metadata": {"kernelspec": kernel, "language_info": {"name": "python"}},
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    return json.dumps(content, indent=1, sort_keys=True, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    NOTEBOOK.write_text(notebook(PAGE.read_text()))
