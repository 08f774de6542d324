"""What a misspelt word was probably meant to be."""

from __future__ import annotations

from collections.abc import Iterable

LONGEST = 80  # characters compared; longer words are no slips of the finger


def closest(word: str, candidates: Iterable[str]) -> str:
    """Return the one of ``candidates`` that ``word`` was probably meant to be; empty if none comes near."""
    import difflib

    by_folded = {str(candidate).casefold(): str(candidate) for candidate in sorted(candidates, reverse=True)}
    near = difflib.get_close_matches(str(word)[:LONGEST].casefold(), list(by_folded), n=1, cutoff=0.6)
    return by_folded[near[0]] if near else ""


def did_you_mean(word: str, candidates: Iterable[str]) -> str:
    """Return a sentence to put behind an error, such as `` Did you mean "restitution"?``; empty if none comes near."""
    found = closest(word, candidates)
    return f' Did you mean "{found}"?' if found else ""
