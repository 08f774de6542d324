"""Which object obeys which laws, kept both ways."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from xpheve.errors import ConflictError
from xpheve.kernels.clock import Instant
from xpheve.objects import warn_of_misspelt

if TYPE_CHECKING:
    from xpheve.laws import PhysicalLaw
    from xpheve.objects import PhysicalObject


class Mapping:
    """Pairs of object and law, each with the instant since when it holds."""

    def __init__(self) -> None:
        self._laws: dict[PhysicalObject, dict[PhysicalLaw, Instant]] = {}
        self._objects: dict[PhysicalLaw, dict[PhysicalObject, None]] = {}

    def laws(self, obj: PhysicalObject) -> dict[PhysicalLaw, Instant]:
        """The laws of ``obj``, each with the instant since when."""
        return self._laws.get(obj, {})

    def objects(self, law: PhysicalLaw) -> dict[PhysicalObject, None]:
        """The objects of ``law``, in no particular order."""
        return self._objects.get(law, {})

    def check(self, obj: PhysicalObject, laws: Iterable[PhysicalLaw]) -> None:
        """Raise `ConflictError` if ``obj`` cannot obey ``laws`` beside those it has, warn of misspelt columns."""
        laws = list(laws)
        if obj._columns:
            warn_of_misspelt(obj, (name for law in [*self.laws(obj), *laws] for name in law.columns))
        held = [law for law in self.laws(obj) if law.enabled]
        for law in laws:
            for other in held:
                shared = law.exclusive & other.exclusive
                if other is not law and shared and law.enabled:
                    raise ConflictError(
                        f"{law!r} and {other!r} both claim {', '.join(sorted(shared))} of {obj!r}. "
                        "Map only one of them to it, disable one (law.enabled = False), or unmap the other first"
                    )
            held.append(law)

    def add(self, obj: PhysicalObject, law: PhysicalLaw, since: Instant) -> None:
        """Let ``obj`` obey ``law``."""
        self._laws.setdefault(obj, {})[law] = since
        self._objects.setdefault(law, {})[obj] = None

    def remove(self, obj: PhysicalObject, law: PhysicalLaw) -> None:
        """Let ``obj`` no longer obey ``law``."""
        del self._laws[obj][law]
        del self._objects[law][obj]

    def remove_object(self, obj: PhysicalObject) -> list[PhysicalLaw]:
        """Forget ``obj``; returns the laws it had."""
        laws = list(self._laws.pop(obj, {}))
        for law in laws:
            del self._objects[law][obj]
        return laws

    def remove_law(self, law: PhysicalLaw) -> list[PhysicalObject]:
        """Forget ``law``; returns the objects it had."""
        objects = list(self._objects.pop(law, {}))
        for obj in objects:
            del self._laws[obj][law]
        return objects
