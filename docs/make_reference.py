"""Makes the reference from the docstrings: static pages in ``docs/_build``, or in the folder given.

Run ``docs/build``, or ``python docs/make_reference.py [FOLDER]``. It needs pdoc, which is among the requirements for development.
"""

from __future__ import annotations

import re
import sys
import warnings
from importlib import import_module
from pathlib import Path

import pdoc
import pdoc.render

import xpheve

MODULES = (
    "xpheve",
    "xpheve.laws.conditions",
    "xpheve.errors",
    "xpheve.meshes",
    "xpheve.orientation",
    "xpheve.shapes",
    "xpheve.steppers.contract",
    "xpheve.plugins",
    "xpheve.trace",
    "xpheve.compile",
    "xpheve.realtime",
    "xpheve.record",
    "xpheve_laws_basic",
    "xpheve_laws_collision",
)

HEAD = """xPheve: an extensible physics engine.

Most of what a program needs is here: `import xpheve as xp`. Beside it there are

- `xpheve.laws.conditions`, which programs call `xp.when`: when laws are called,
- `xpheve.errors`: what is raised,
- `xpheve.shapes`: what objects look like; `xpheve.meshes`: mesh files and scene graphs,
- `xpheve.orientation`: quaternions out of other ways to say how a thing is turned, and back,
- `xpheve.steppers.contract` and `xpheve.plugins`: for authors of steppers and of packs,
- `xpheve.trace`: what is read off a law's formula, its derivatives, and checks for the tests of a pack,
- `xpheve.compile`: what was compiled, who is told of it; texts and kernels, for authors of steppers,
- `xpheve_laws_basic` and `xpheve_laws_collision`: the laws that come along, each by its id.
"""


def gather(kind: type) -> None:
    """Show what ``kind`` has from the rooms that it is made of, which have no pages, as its own."""
    for part in kind.__mro__[1:-1]:
        for name, value in vars(part).items():
            if not name.startswith("_") and name not in vars(kind):
                setattr(kind, name, value)


def make(folder: Path) -> None:
    """Write the pages into ``folder``."""
    for name in MODULES:  # names that are loaded when they are touched are put where pdoc looks
        home = import_module(name)
        vars(home).update({key: getattr(home, key) for key in getattr(home, "__all__", ())})
    gather(xpheve.PhysicsEngine)
    xpheve.__doc__ = HEAD
    pdoc.render.configure(docformat="numpy", show_source=False, footer_text=f"xPheve {xpheve.__version__}")
    shown = [part for name in MODULES for part in (name, rf"!{re.escape(name)}\..*")]
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Error parsing type annotation")  # it is then shown as it is written
        pdoc.pdoc(*shown, output_directory=folder)


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "_build"
    make(target)
    print(f"{target / 'index.html'}: written")
