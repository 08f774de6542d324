"""Python's parser, by one thread at a time.

Python 3.11 counts the depth of a tree for all threads together, and a parse may fail with a SystemError while another thread parses
(https://github.com/python/cpython/issues/106905). What others parse meanwhile is out of our hands: then it is tried again.
"""

from __future__ import annotations

import ast
from threading import Lock

_LOCK = Lock()
TRIES = 5


def parse(text: str | bytes, name: str = "<text>") -> ast.Module:
    """`ast.parse`; raises what it raises."""
    with _LOCK:
        for _ in range(TRIES - 1):
            try:
                return ast.parse(text, name)
            except SystemError:
                continue
        return ast.parse(text, name)
