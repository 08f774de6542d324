"""Pack: what one pack offers once its module is imported. It is also the ``registry`` that ``xpheve_register`` gets."""

from __future__ import annotations

import inspect
import re
import sys
from importlib import import_module
from types import ModuleType
from typing import Any

from xpheve.errors import LawDefinitionError, PackError
from xpheve.laws import LawContainer, PhysicalLaw
from xpheve.laws.conditions import Condition
from xpheve.plugins import hooks
from xpheve.plugins.spec import ID_PATTERN, LawSpec, check_spec, spec_of
from xpheve.plugins.suggest import did_you_mean

__all__ = ["KINDS", "Pack", "as_source", "collect", "guess_name", "import_object", "kind_of"]

KINDS = ("law", "container", "shape", "stepper", "contact_server")

# Contracts of core that are looked for only where they are loaded already: a pack that has a stepper has loaded them.
CONTRACTS = (
    ("xpheve.steppers.contract", "Stepper", "stepper"),
    ("xpheve.steppers.contract", "ContactServer", "contact_server"),
    ("xpheve.shapes", "Shape", "shape"),
)


def kind_of(thing: Any) -> str:
    """Return which of `KINDS` the class ``thing`` is of; empty for anything else.

    Laws and containers are known by their base class; the rest by a class attribute ``offers``, or their base class.
    """
    if not isinstance(thing, type):
        return ""
    if issubclass(thing, PhysicalLaw):
        return "law"
    if issubclass(thing, LawContainer):
        return "container"
    offers = getattr(thing, "offers", None)
    if isinstance(offers, str) and offers in KINDS[2:]:
        return offers
    for module, name, kind in CONTRACTS:
        base = getattr(sys.modules.get(module), name, None)
        if isinstance(base, type) and issubclass(thing, base):
            return kind
    return ""


def import_object(reference: str) -> Any:
    """Return the module ``"package.module"``, or the object ``"package.module:name"`` in it."""
    module, colon, name = reference.partition(":")
    found: Any = import_module(module.strip())
    for part in name.strip().split(".") if colon else ():
        found = getattr(found, part)
    return found


class Pack:
    """What one pack offers, by kind and id.

    Parameters
    ----------
    name
        The name of the pack: its ids begin with it.

    """

    def __init__(self, name: str, *, distribution: str = "", version: str = "", location: str = "") -> None:
        """Start with nothing; `collect` fills it."""
        self.name = name
        self.distribution = distribution
        self.version = version
        self.location = location
        self.source: Any = None
        self.given: Any = None
        self.offered: dict[str, dict[str, type | str]] = {kind: {} for kind in KINDS}
        self.specs: dict[str, LawSpec] = {}
        self.remarks: list[str] = []
        self.seconds = 0.0

    def __repr__(self) -> str:
        """Return name and counts."""
        counts = ", ".join(f"{len(things)} {kind}s" for kind, things in self.offered.items() if things)
        return f"<pack {self.name}: {counts or 'nothing'}>"

    def add_law(self, law: type[PhysicalLaw] | str, *, id: str = "") -> None:
        """Offer a law class, or ``"module:Class"``, which is imported at first use if its ``id`` is given."""
        self._add("law", law, id)

    def add_container(self, container: type[LawContainer] | str, *, id: str = "") -> None:
        """Offer a class of containers, as `add_law` does laws."""
        self._add("container", container, id)

    def add_shape(self, shape: type | str, *, id: str = "") -> None:
        """Offer a class of shapes, as `add_law` does laws."""
        self._add("shape", shape, id)

    def add_stepper(self, stepper: type | str, *, id: str = "") -> None:
        """Offer a class of steppers, as `add_law` does laws."""
        self._add("stepper", stepper, id)

    def add_contact_server(self, server: type | str, *, id: str = "") -> None:
        """Offer a class of contact servers, as `add_law` does laws."""
        self._add("contact_server", server, id)

    def resolve(self, kind: str, id: str) -> type:
        """Return the class offered as ``id``; one given as text is imported and checked now."""
        thing = self.offered[kind][id]
        if isinstance(thing, str):
            found = import_object(thing)
            actual = self._check(kind, found, "")
            if actual != id:
                raise LawDefinitionError(f'{thing} was offered as "{id}", but its id is "{actual}"')
            self.offered[kind][id] = thing = found
        return thing

    def _add(self, kind: str, thing: Any, id: str) -> None:
        if isinstance(thing, str):
            if not re.fullmatch(r"[A-Za-z_][\w.]*:[A-Za-z_][\w.]*", thing):
                raise LawDefinitionError(f'{thing!r}: give a class, or "module:Class"')
            if not id:
                thing = import_object(thing)
        if isinstance(thing, str):
            self._check_id(thing, id)
        else:
            id = self._check(kind, thing, id)
        before = self.offered[kind].get(id)
        if before is not None and before is not thing:
            raise LawDefinitionError(
                f'both {_where(before)} and {_where(thing)} have the id "{id}": give one of them another'
            )
        self.offered[kind][id] = thing

    def _check(self, kind: str, thing: Any, id: str) -> str:
        """Return the id of ``thing``; raises `LawDefinitionError` unless it is a sound class of that kind."""
        if not isinstance(thing, type):
            raise LawDefinitionError(f"{thing!r} is no class; a pack offers classes")
        if kind == "law":
            return self._check_law(thing)
        if kind == "container":
            return self._check_container(thing)
        if kind_of(thing) not in ("", kind):
            raise LawDefinitionError(f"{_where(thing)} is a {kind_of(thing)}, not a {kind}")
        own = id or getattr(thing, "id", "") or getattr(thing, "kind", "") or _snake(thing.__name__)
        found = str(own) if ":" in str(own) else f"{self.name}:{own}"
        self._check_id(thing, found)
        return found

    def _check_law(self, law: Any) -> str:
        spec = spec_of(law)
        check_spec(spec, law, pack=self.name)
        if not law.is_concrete():
            method = {
                "response": "respond(self, contact)",
                "free": "enforce_this_law(self, event)",
                "flow": "flow(self, body, dt)",
            }.get(spec.kind, "force(self, a, b)" if spec.kind == "pair" else "force(self, body)")
            raise LawDefinitionError(f"{_where(law)} has the id {law.id!r} but says nothing: write {method}")
        if not spec.doc and sys.flags.optimize < 2:
            self.remarks.append(f"{law.id} has no docstring, so that listings cannot say what it does")
        self.specs[spec.id] = spec
        return spec.id

    def _check_container(self, container: Any) -> str:
        where = _where(container)
        if not issubclass(container, LawContainer):
            raise LawDefinitionError(f"{where} is no container: derive it from LawContainer")
        if not container.id:
            raise LawDefinitionError(f'{where} has no id: give it one, such as id = "{self.name}:name"')
        condition: object = container.condition
        if condition is not None and not isinstance(condition, Condition):
            raise LawDefinitionError(f"{where}: condition = {condition!r}: give a condition such as Impact()")
        accepts: object = container.accepts
        if not (isinstance(accepts, type) and issubclass(accepts, PhysicalLaw)):
            raise LawDefinitionError(f"{where}: accepts = {accepts!r}: give a class of laws")
        found: str = container.id
        self._check_id(container, found)
        return found

    def _check_id(self, thing: Any, id: Any) -> None:
        if not isinstance(id, str) or not re.fullmatch(ID_PATTERN[1:-1], id):
            raise LawDefinitionError(f"{_where(thing)}: id = {id!r}: {self.name}:name is needed, in lower case")
        prefix, _, rest = id.partition(":")
        if prefix != self.name:
            raise LawDefinitionError(
                f'{_where(thing)}: id = "{id}": ids begin with the name of their pack, here "{self.name}:{rest}"'
            )


def collect(pack: Pack, source: Any) -> dict[str, Any]:
    """Put what ``source`` (a module or an object) offers into ``pack``; returns its implementations of hooks.

    Raises
    ------
    PackError
        If anything about it is wrong. Whatever the pack's own code raises comes through.

    """
    pack.source = source
    found = hooks.implementations(source)
    pack.remarks += hooks.audit(source)
    if "xpheve_register" in found:
        manager = hooks.new_manager()
        manager.register(source, pack.name)
        manager.hook.xpheve_register(registry=pack)
    else:
        for name, thing in _public(source, pack.remarks):
            _offer(pack, name, thing)
    return found


def _offer(pack: Pack, name: str, thing: Any) -> None:
    kind = kind_of(thing)
    if not kind:
        return
    module = str(getattr(thing, "__module__", ""))
    if module == "xpheve" or module.startswith("xpheve."):
        return  # core's own, exported once more for convenience
    if kind == "law" and not thing.id and not thing.is_concrete():
        return  # a base class that the pack's laws share
    if kind not in ("law", "container") and (name.startswith("_") or inspect.isabstract(thing)):
        return
    if kind == "container" and not thing.id and not name.startswith("_"):
        raise LawDefinitionError(f'{_where(thing)} has no id: give it one, such as id = "{pack.name}:{_snake(name)}"')
    pack._add(kind, thing, "")


def _public(source: Any, remarks: list[str]) -> list[tuple[str, Any]]:
    """Return what ``source`` names in ``__all__``, in that order."""
    called = getattr(source, "__name__", type(source).__name__)
    names = getattr(source, "__all__", None)
    if names is None:
        unmarked = f" ({'; '.join(remarks)})" if remarks else ""
        raise PackError(
            f"{called} has neither __all__ nor a hook{unmarked}; is it really a pack? Name its laws in __all__"
        )
    if isinstance(names, str) or not isinstance(names, (list, tuple)) or not all(isinstance(n, str) for n in names):
        raise PackError(f"__all__ of {called} is {names!r}: a list of names is needed")
    found: list[tuple[str, Any]] = []
    for name in names:
        try:
            found.append((name, getattr(source, name)))
        except AttributeError:
            at_hand = [other for other in vars(source) if not other.startswith("_")]
            raise PackError(
                f"__all__ of {called} names {name!r}, which is not there.{did_you_mean(name, at_hand)}"
            ) from None
    return found


def as_source(source: Any) -> Any:
    """Return ``source`` with ``__all__`` or hooks: classes, and a module without either, are given an ``__all__``."""
    if isinstance(source, type):
        source = [source]
    if isinstance(source, (list, tuple)):
        for thing in source:
            if not kind_of(thing):
                raise LawDefinitionError(f"{thing!r} is no class of laws, containers, shapes or steppers")
        listed = ModuleType(source[0].__module__ if source else "nothing")
        listed.__dict__.update({f"{thing.__qualname__}_{index}": thing for index, thing in enumerate(source)})
        listed.__dict__["__all__"] = [f"{thing.__qualname__}_{index}" for index, thing in enumerate(source)]
        return listed
    if not isinstance(source, ModuleType) or hasattr(source, "__all__"):
        return source
    if "xpheve_register" in hooks.implementations(source):
        return source
    known = ModuleType(source.__name__)
    known.__dict__.update(vars(source))
    known.__dict__["__all__"] = [
        name for name, thing in vars(source).items() if kind_of(thing) and thing.__module__ == source.__name__
    ]
    return known


def guess_name(source: Any) -> str:
    """Return the prefix of the first id in ``__all__``. Raises `PackError` if there is none."""
    names = getattr(source, "__all__", ())
    for name in names if isinstance(names, (list, tuple)) else ():
        id = getattr(getattr(source, str(name), None), "id", "")
        if isinstance(id, str) and ":" in id:
            return id.partition(":")[0]
    raise PackError(f"{getattr(source, '__name__', source)!r}: say the name of the pack")


def _where(thing: Any) -> str:
    if isinstance(thing, type):
        return f"{thing.__module__}.{thing.__qualname__}"
    return str(thing)


def _snake(name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower().strip("_")
