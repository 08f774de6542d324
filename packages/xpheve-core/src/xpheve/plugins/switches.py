"""Switches: which packs a program or its user forbids, allows only, or prefers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from xpheve.plugins.index import Offer, normalised
from xpheve.plugins.suggest import did_you_mean

__all__ = ["Switches", "read_switches"]

AUTOLOAD = "XPHEVE_DISABLE_AUTOLOAD"


@dataclass(frozen=True, slots=True)
class Switches:
    """What is switched off, by name, each with the switch that says so.

    ``disabled`` holds names of packs and distributions, and ids; ``allowed`` pairs of the names outside which nothing
    is loaded and their switch; ``preferred`` distributions, the most preferred first.
    """

    disabled: Mapping[str, str] = field(default_factory=dict)
    allowed: tuple[tuple[frozenset[str], str], ...] = ()
    preferred: tuple[str, ...] = ()
    tracing: bool = False

    def forbids(self, offer: Offer) -> tuple[str, str] | None:
        """Return why ``offer`` may not be loaded, and the way out; None if it may."""
        names = {normalised(offer.name), normalised(offer.distribution)}
        for word, said in self.disabled.items():
            if ":" not in word and normalised(word) in names:
                return f"disabled by {said}", f'take "{word}" out of it'
        for allowed, said in self.allowed:
            if not allowed & names:
                if said == AUTOLOAD:
                    return f"not loaded under {AUTOLOAD}", f"set XPHEVE_PACKS={offer.name}"
                return f"disabled by {said}", f'put "{offer.name}" into it'
        return None

    def idle(self, known: Iterable[str]) -> list[str]:
        """Return remarks on names in the switches that are none of ``known`` packs and distributions."""
        known = set(known)
        at_hand = {normalised(word) for word in known}
        named = {word.partition(":")[0]: said for word, said in self.disabled.items()}
        for allowed, said in self.allowed:
            named |= dict.fromkeys(sorted(allowed), said)
        return [
            f'{said} names "{word}", which is not installed.{did_you_mean(word, known)}'
            for word, said in named.items()
            if normalised(word) not in at_hand
        ]


def read_switches(
    environment: Mapping[str, str],
    *,
    disable: Iterable[str] = (),
    allow: Iterable[str] | None = None,
    prefer: Iterable[str] = (),
) -> Switches:
    """Return the switches in ``environment`` (``XPHEVE_DISABLE``, ...) joined to those given in the program."""

    def words(name: str) -> list[str]:
        return [word.strip() for word in environment.get(name, "").split(",") if word.strip()]

    def is_on(name: str) -> bool:
        return environment.get(name, "").strip().lower() not in ("", "0", "false", "no", "off")

    disable, prefer = list(disable), list(prefer)
    disabled = dict.fromkeys(words("XPHEVE_DISABLE"), f'XPHEVE_DISABLE="{environment.get("XPHEVE_DISABLE", "")}"')
    disabled |= dict.fromkeys(disable, f"disable={disable!r}")
    allowed: list[tuple[frozenset[str], str]] = []
    if allow is not None:
        allow = list(allow)
        allowed.append((frozenset(map(normalised, allow)), f"allow={allow!r}"))
    if words("XPHEVE_PACKS"):
        only = frozenset(map(normalised, words("XPHEVE_PACKS")))
        allowed.append((only, f'XPHEVE_PACKS="{environment["XPHEVE_PACKS"]}"'))
    elif is_on(AUTOLOAD) and allow is None:
        allowed.append((frozenset(), AUTOLOAD))
    preferred = tuple(normalised(word) for word in (*prefer, *words("XPHEVE_PREFER")))
    return Switches(disabled, tuple(allowed), preferred, is_on("XPHEVE_TRACE"))
