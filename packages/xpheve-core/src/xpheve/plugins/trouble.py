"""Trouble: code of other people's packs called so that nothing it raises gets past, and put into words."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, TypeVar

from xpheve.errors import XpheveError
from xpheve.plugins.index import Offer

__all__ = ["Trouble", "guarded", "text_of", "title", "way_out"]

T = TypeVar("T")
LONGEST = 400  # characters of another pack's exception that are passed on

# Where a module is not called as its distribution.
DISTRIBUTIONS = {"yaml": "pyyaml", "PIL": "pillow", "cv2": "opencv-python", "sklearn": "scikit-learn"}


class Trouble(Exception):
    """Carries what a pack's code raised, whatever it was, to the place that deals with it."""

    def __init__(self, cause: BaseException) -> None:
        """Carry ``cause``."""
        super().__init__()
        self.cause = cause


def guarded(function: Callable[..., T], *arguments: Any) -> T:
    """Call a pack's code; all that it raises becomes `Trouble`, even SystemExit, but not KeyboardInterrupt."""
    try:
        return function(*arguments)
    except KeyboardInterrupt:
        raise
    except BaseException as wrong:
        raise Trouble(wrong) from wrong


def title(distribution: str, version: str) -> str:
    """Return how a distribution is called in messages, such as ``xpheve-aero 1.2``."""
    return f"{distribution} {version}".strip()


def text_of(wrong: BaseException) -> str:
    """Return type and text of an exception on one line; its own ``__str__`` may fail too."""
    try:
        text = " ".join(str(wrong).split())
    except Exception:
        text = "its text cannot be shown"
    if len(text) > LONGEST:
        text = text[:LONGEST] + "..."
    return f"{type(wrong).__name__}: {text}" if text else type(wrong).__name__


def way_out(offer: Offer, wrong: BaseException) -> str:
    """Return what a user can do about the pack ``offer`` that failed with ``wrong``."""
    own = offer.module.partition(":")[0].partition(".")[0]
    missing = (wrong.name or "") if isinstance(wrong, ImportError) else ""
    top = missing.partition(".")[0]
    if top == "xpheve":
        return f"it was made for another xpheve; pip install --upgrade {offer.distribution} xpheve-core"
    if isinstance(wrong, ModuleNotFoundError) and top == own:
        return (
            f"reinstall {offer.distribution}, whose module {missing} is not there (after an editable install, start "
            "Python anew)"
        )
    if isinstance(wrong, ModuleNotFoundError) and top:
        return f"pip install {DISTRIBUTIONS.get(top, top)}"
    if isinstance(wrong, SyntaxError):
        file = os.path.basename(wrong.filename or "its source")
        return f"{file}, line {wrong.lineno}, cannot be read by this Python; upgrade {offer.distribution}"
    if isinstance(wrong, (OSError, ValueError)) and not isinstance(wrong, XpheveError):
        return f"reinstall {offer.distribution}, or report it to its authors"
    return f"upgrade {offer.distribution}, or report it to its authors"
