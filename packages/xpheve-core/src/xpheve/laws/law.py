"""PhysicalLaw and its kinds: *what* happens. A law container or a stepper says when."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeVar

from xpheve.errors import InvalidValueError, LawDefinitionError, ParameterError
from xpheve.laws.conditions import Condition
from xpheve.laws.event import Contact, Event
from xpheve.laws.param import Column, Param

if TYPE_CHECKING:
    from xpheve.laws.container import LawContainer
    from xpheve.laws.response import ResponseLaw
    from xpheve.laws.view import BodyView
    from xpheve.objects import PhysicalObject

API_VERSION = 1
"""Version of the law contract; a pack's manifest says which it was written for."""


class LawHost(Protocol):
    """What a law may ask of the engine that holds it."""

    @property
    def time(self) -> float: ...
    def objects_of(self, law: PhysicalLaw) -> tuple[PhysicalObject, ...]: ...
    def set_parameter(self, law: PhysicalLaw, name: str, value: Any) -> None: ...
    def set_enabled(self, law: PhysicalLaw, value: bool) -> None: ...
    def set_pairs(self, law: ResponseLaw, pairs: dict[frozenset[PhysicalObject], dict[str, Any]]) -> None: ...
    def law_changed(self, law: PhysicalLaw, what: str, old: Any) -> None: ...
    def evaluate_and_store(self, law: PhysicalLaw) -> None: ...
    def answer_contacts(self, law: ResponseLaw, contacts: tuple[Contact, ...]) -> None: ...
    def random_stream(self, law: PhysicalLaw) -> Any: ...
    def post(self, id: Any, data: Any = None, source: Any = None) -> None: ...
    def acting(self, law: PhysicalLaw) -> AbstractContextManager[None]: ...


class PhysicalLaw:
    """One rule of nature over the objects that are mapped to it.

    A free-form law overrides `enforce_this_law` and is an event handler: it runs when its condition fires. Most laws
    are better written as one of the kinds below.

    Parameters
    ----------
    name
        For listings and scene files; may stay empty.
    enabled
        A disabled law does nothing and its stored forces are withdrawn.
    **parameters
        Values of the `Param` s of the class; SI numbers, or text with a unit such as ``"9.81 m/s^2"``.

    Raises
    ------
    ParameterError
        If a parameter is unknown or does not fit its declaration.
    """

    id: ClassVar[str] = ""
    role: ClassVar[str] = "law"
    condition: ClassVar[Condition | None] = None
    """When the law is enforced if it is put into no container; None for laws that act all the time."""
    in_containers: ClassVar[bool] = True
    """Whether the law may be enforced at an event."""
    container: ClassVar[str] = ""
    """Id of the container class that holds the law if none is given; empty for the plain `LawContainer`."""
    columns: ClassVar[dict[str, Column]] = {}
    initial_state: ClassVar[dict[str, Any]] = {}
    """Numbers, text and lists that the law keeps between calls in ``self.state``; saved by checkpoints."""
    before: ClassVar[tuple[str, ...]] = ()
    after: ClassVar[tuple[str, ...]] = ()
    priority: ClassVar[int] = 0
    exclusive: ClassVar[frozenset[str]] = frozenset()
    """Resources of which an object has one only, such as ``contact-response``."""
    params: ClassVar[dict[str, Param]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if inspect.getattr_static(cls, "enforce") is not PhysicalLaw.__dict__["enforce"]:
            raise LawDefinitionError(
                f"{cls.__name__} overrides enforce, which is final: it checks `enabled` and counts; write enforce_this_law"
            )
        found = dict(cls.params)
        found.update({name: value for name, value in cls.__dict__.items() if isinstance(value, Param)})
        cls.params = found

    def __init__(self, *, name: str = "", enabled: bool = True, **parameters: Any) -> None:
        label = type(self).label()
        for key in parameters:
            if key not in self.params:
                from xpheve.plugins.suggest import did_you_mean

                raise ParameterError(
                    f"{label} has no parameter {key!r}; it has: {', '.join(self.params) or 'none'}."
                    + did_you_mean(key, list(self.params))
                )
        self._name = name
        self._enabled = bool(enabled)
        self.parameters: dict[str, Any] = {
            key: param.check(parameters[key], label) if key in parameters else param.default
            for key, param in self.params.items()
        }
        self.state: dict[str, Any] = {
            key: list(value) if isinstance(value, list) else value for key, value in self.initial_state.items()
        }
        self.containers: list[LawContainer] = []
        self.evaluations = 0
        """How often the law was evaluated: calls of its method, each for all the objects concerned."""
        self.engine: LawHost | None = None

    def __setattr__(self, name: str, value: Any) -> None:
        """Set an attribute; in an engine, one that is a slip of the finger for a parameter raises `ParameterError`."""
        if name not in self.__dict__ and self.__dict__.get("engine") is not None and not hasattr(type(self), name):
            near = get_close_matches(name, self.params, n=1, cutoff=0.8)
            if near:
                raise ParameterError(
                    f'{self.label()} has no parameter {name!r}; it has: {", ".join(self.params)}. Did you mean "{near[0]}"?'
                )
        super().__setattr__(name, value)

    @property
    def name(self) -> str:
        """For listings and scene files; fixed once the law is in an engine."""
        return self._name

    @name.setter
    def name(self, value: str) -> None:
        if self.engine is not None:
            raise InvalidValueError(f"{self!r}: name = {value!r}: a law in an engine keeps its name")
        self._name = value

    @classmethod
    def label(cls) -> str:
        """The id, or the class name of a law that has none."""
        return cls.id or cls.__name__

    def __repr__(self) -> str:
        named = f" {self.name!r}" if self.name else ""
        return f"<{self.label()}{named}{'' if self._enabled else ' disabled'}>"

    def set_parameter(self, name: str, value: Any) -> None:
        """Set parameter ``name``; stored forces follow at this instant. Raises `ParameterError`."""
        checked = self.params[name].check(value, self.label())
        if self.engine is None:
            self.put_parameter(name, checked)
        else:
            self.engine.set_parameter(self, name, checked)

    def put_parameter(self, name: str, checked: Any) -> None:
        """For the engine: set parameter ``name``, checked already, at this instant."""
        old = self.parameters[name]
        if checked == old:
            return
        self.parameters[name] = checked
        if self.engine is not None:
            self.engine.law_changed(self, name, old)

    @property
    def enabled(self) -> bool:
        """Whether the law acts. Setting it takes effect at this instant of simulation time."""
        return self._enabled

    @enabled.setter
    def enabled(self, value: bool) -> None:
        if self.engine is None:
            self.put_enabled(value)
        else:
            self.engine.set_enabled(self, bool(value))

    def put_enabled(self, value: bool) -> None:
        """For the engine: switch the law at this instant."""
        old = self._enabled
        self._enabled = bool(value)
        if self.engine is not None and old != self._enabled:
            self.engine.law_changed(self, "enabled", old)

    @property
    def objects(self) -> tuple[PhysicalObject, ...]:
        """The objects mapped to the law, in rank order; empty outside an engine."""
        return self.engine.objects_of(self) if self.engine is not None else ()

    @property
    def random(self) -> Any:
        """The law's own `numpy.random.Generator`, seeded by the scene; saved by checkpoints."""
        if self.engine is None:
            raise InvalidValueError(
                f"{self.label()}: random numbers come from the scene's seed; add the law to an engine"
            )
        return self.engine.random_stream(self)

    def enforce(self, event: Event) -> None:
        """Enforce the law now, if it is enabled. Final: the law's own part is `enforce_this_law`."""
        if not self._enabled:
            return
        self.evaluations += 1
        if self.engine is None:
            self.enforce_this_law(event)
            return
        with self.engine.acting(self):
            self.enforce_this_law(event)

    def enforce_this_law(self, event: Event) -> None:
        """The law's own part: whatever happens at this event."""
        raise LawDefinitionError(f"{type(self).__name__} says nothing: write enforce_this_law(self, event)")

    @classmethod
    def is_concrete(cls) -> bool:
        """Whether the class says what happens, so that a pack may offer it."""
        return cls.enforce_this_law is not PhysicalLaw.enforce_this_law


Method = TypeVar("Method", bound=Callable[..., Any])

_SILENT: set[Any] = set()
"""The methods of the contract itself, which say nothing."""


def silent(method: Method) -> Method:
    """Mark ``method`` as one of the contract, which a law may write."""
    _SILENT.add(method)
    return method


class ContinuousLaw(PhysicalLaw):
    """What `FieldLaw` and `PairLaw` share: a force written once as an expression over batches of objects."""

    role = "force"
    singular: ClassVar[str] = ""
    """A sentence that says where the force has no finite value; it ends the error that such a force raises."""
    periodic: ClassVar[bool] = False
    """Whether the law gives the same force for every image of an object: then it may read ``position`` in periodic scenes."""
    kernel: ClassVar[str] = ""
    """Import path of a kernel file written by hand, in place of an expression.

    Its function ``force`` takes arguments named after what it reads, ``position`` and ``velocity`` as tuples, ``mass``, columns, parameters and
    ``time`` as floats, and returns the force [N] as a tuple of three; it imports `math` and other kernel files only.
    """

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        for method in ("force", "torque"):
            if cls.defines("apply") and cls.defines(method):
                raise LawDefinitionError(
                    f"{cls.__name__} has both {method} and apply, and the engine would not know which to believe: {method} is an expression, "
                    "which is traced and compiled; apply is NumPy, which is neither. Keep one of them"
                )

    @silent
    def jumps(self, since: float) -> tuple[float, ...]:
        """Simulation times [s] at which the force on an object that came under the law at ``since`` jumps.

        A step never passes one: it ends there, and the next begins. So a force that is switched by ``body.time`` and
        ``body.since`` is switched at the exact instant. Optional; without it the force is taken to be smooth in time.
        """
        return ()

    def enforce_this_law(self, event: Event) -> None:
        """Evaluate once and store the force on each object until the next event (zero-order hold)."""
        if self.engine is not None:
            self.engine.evaluate_and_store(self)

    @classmethod
    def defines(cls, method: str) -> bool:
        """Whether the class itself (or a parent other than the contract) has ``method``."""
        found = getattr(cls, method, None)
        return found is not None and found not in _SILENT

    @classmethod
    def is_concrete(cls) -> bool:
        return bool(cls.kernel) or any(map(cls.defines, ("force", "torque", "apply")))


class FieldLaw(ContinuousLaw):
    """A force (or torque) on each object from its own state and time.

    ``force(self, body)`` gets a batch: ``body.position``, ``velocity`` and ``angular_velocity`` are arrays of shape
    (n, 3), ``body.mass`` and columns are (n, 1), so that expressions broadcast; ``norm()``, ``dot()`` and ``cross()``
    keep that rule. It returns forces [N] of shape (n, 3), or anything that broadcasts to it. A law that reads neither state nor
    time is *constant*: it is evaluated once and its force is stored.
    """

    @silent
    def force(self, body: BodyView) -> Any:
        """Force [N] on each body of the batch, world frame, at the centre of mass."""
        raise LawDefinitionError(f"{type(self).__name__}: write force(self, body)")

    @silent
    def torque(self, body: BodyView) -> Any:
        """Torque [N m] on each body of the batch, world frame. Optional."""
        raise LawDefinitionError(f"{type(self).__name__}: write torque(self, body)")

    @silent
    def apply(self, body: BodyView) -> Any:
        """Forces [N], shape (n, 3), in plain NumPy: in place of `force` where no formula does. Never traced, so never compiled.

        Its units are not checked, and it is called for each evaluation, so that the objects of its batch step law by law. There is no
        `torque` beside it: a second law may have one. A `potential` beside it is called in NumPy, too, and not held against the force.
        """
        raise LawDefinitionError(f"{type(self).__name__}: write apply(self, body)")

    @silent
    def potential(self, body: BodyView) -> Any:
        """Potential energy [J] of each body, shape (n, 1). Optional; without it the law's work is reported."""
        raise LawDefinitionError(f"{type(self).__name__}: write potential(self, body)")


class PairLaw(ContinuousLaw):
    """A force between two objects: on the first, and its opposite on the second.

    It acts on every pair of objects that are both mapped to it; with ``between`` on the pairs of one object of the first and one of
    the second group; with ``pairs`` on these alone, such as the springs of a network. The first of a pair as given is ``a``.

    ``one_sided`` says that of ``between`` the first only act, and the second only feel it: a planet and the dust that it pulls. What acts
    is then moved on first, in steps of its own, and feels nothing of those that it acts on, so that momentum is not conserved.

    Parameters
    ----------
    between
        Two objects, or two lists of objects.
    pairs
        Pairs of objects, each pair once in either order.
    one_sided
        Whether only the second of ``between`` feel the law.
    name, enabled, **parameters
        As in `PhysicalLaw`.

    Raises
    ------
    InvalidValueError
        If ``between`` or ``pairs`` is not of that form, or both are given; if ``one_sided`` has no ``between``, or one with an object on both sides.
    """

    cutoff: Any = math.inf
    """Distance [m] from which on force and potential are exactly 0, whatever the methods say: a number, a property, or
    ``cutoff = Param(2.5, unit="m", gt=0)``; None is as infinite. The potential must come to 0 there, so subtract its value at the
    cutoff: else energy jumps by that value whenever a pair passes the cutoff."""

    error: Any = 0.0
    """Relative error, of each body's whole force by the law, that sums over many bodies may have: the 99th percentile of the bodies; a
    number, a property, or ``error = Param(0.0, unit="1", ge=0, le=0.1)``. 0: sums are exact to rounding. Laws that fall with the square of
    the distance are then summed by a tree where that is faster."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        found = inspect.getattr_static(cls, "cutoff")
        if isinstance(found, Param):
            if found.kind != "number" or found.gt is None or found.gt < 0.0:
                raise LawDefinitionError(
                    f"{cls.__name__}: a cutoff is a length above 0: "
                    f'write cutoff = Param({found.default!r}, unit="m", gt=0)'
                )
        elif found is None or isinstance(found, (bool, int, float, str)):
            _length(found, cls.__name__)

    def __init__(
        self,
        *,
        between: tuple[Iterable[PhysicalObject], Iterable[PhysicalObject]] | None = None,
        pairs: Iterable[tuple[PhysicalObject, PhysicalObject]] | None = None,
        one_sided: bool = False,
        name: str = "",
        enabled: bool = True,
        **parameters: Any,
    ) -> None:
        super().__init__(name=name, enabled=enabled, **parameters)
        if between is not None and pairs is not None:
            raise InvalidValueError(
                f"{self.label()}: between and pairs both say which pairs; give one, or a law for each"
            )
        self.between: tuple[tuple[PhysicalObject, ...], tuple[PhysicalObject, ...]] | None = None
        if between is not None:
            self.between = _sides(between, self.label())
        self.pairs: tuple[tuple[PhysicalObject, PhysicalObject], ...] | None = None
        if pairs is not None:
            self.pairs = _pairs(pairs, self.label())
        self.one_sided = one_sided
        self.check_sides()
        self._sided: tuple[Any, dict[PhysicalObject, int]] = (None, {})
        self._joined: tuple[Any, dict[PhysicalObject, list[PhysicalObject]]] = (None, {})

    def check_sides(self) -> None:
        """Raise `InvalidValueError` if it is one-sided, and its sides are none."""
        if not isinstance(self.one_sided, bool):
            raise InvalidValueError(f"{self.label()}: one_sided = {self.one_sided!r}: True or False is needed")
        if not self.one_sided:
            return
        if self.between is None:
            raise InvalidValueError(
                f"{self.label()}: one_sided says who acts on whom: give between=(sources, targets) with it"
            )
        both = set(self.between[0]).intersection(self.between[1])
        if both:
            named = min(both, key=lambda obj: obj.serial)
            raise InvalidValueError(
                f"{self.label()}: {named!r} is among the sources and the targets of between; what the sources do to one another "
                "is a law of its own, that is not one_sided"
            )

    def side_of(self, obj: PhysicalObject) -> int:
        """On which side of ``between`` an object is: 1 for the first, 2 for the second, 3 for both, 0 for none."""
        if self._sided[0] is not self.between:
            found: dict[PhysicalObject, int] = {}
            for number, side in zip((1, 2), self.between or ((), ()), strict=True):
                for one in side:
                    found[one] = found.get(one, 0) | number
            self._sided = (self.between, found)
        return self._sided[1].get(obj, 0)

    def moves(self, obj: PhysicalObject) -> bool:
        """Whether an object that is mapped to the law feels it: all do, but for the sources of a one-sided one."""
        return not self.one_sided or self.side_of(obj) == 2

    @property
    def named(self) -> tuple[PhysicalObject, ...] | None:
        """The objects that ``between`` or ``pairs`` name, each once; None where neither was given."""
        groups = self.pairs if self.between is None else self.between
        return None if groups is None else tuple({obj: None for group in groups for obj in group})

    def joined(self, obj: PhysicalObject) -> Sequence[PhysicalObject]:
        """The objects that ``pairs`` join with ``obj``, as given."""
        if self._joined[0] is not self.pairs:
            found: dict[PhysicalObject, list[PhysicalObject]] = {}
            for a, b in self.pairs or ():
                found.setdefault(a, []).append(b)
                found.setdefault(b, []).append(a)
            self._joined = (self.pairs, found)
        return self._joined[1].get(obj, ())

    def reach(self) -> float:
        """The cutoff [m] as it is now, infinite if there is none; raises `LawDefinitionError` if it is no length above 0."""
        return _length(self.cutoff, self.label())

    def allowed_error(self) -> float:
        """The relative error that sums may have, as it is now; raises `LawDefinitionError` if it is not from 0 to 0.1."""
        try:
            found = math.nan if isinstance(self.error, (bool, str)) else float(self.error)
        except (TypeError, ValueError):
            found = math.nan
        if not 0.0 <= found <= 0.1:
            raise LawDefinitionError(
                f"{self.label()}.error = {self.error!r}: a relative error from 0, for exact sums, to 0.1 is needed; of a parameter: "
                'error = Param(0.0, unit="1", ge=0, le=0.1)'
            )
        return found

    @silent
    def force(self, a: BodyView, b: BodyView) -> Any:
        """Force [N] on ``a`` of each pair, shape (pairs, 3), world frame; its opposite acts on ``b``."""
        raise LawDefinitionError(f"{type(self).__name__}: write force(self, a, b)")

    @silent
    def apply(self, a: BodyView, b: BodyView) -> Any:
        """Forces [N] on ``a`` of each pair, shape (pairs, 3), in plain NumPy, in place of `force`. Never traced, so never compiled.

        As `FieldLaw.apply`, but that pairs come some at a time: it may look at the pairs it is given alone.
        """
        raise LawDefinitionError(f"{type(self).__name__}: write apply(self, a, b)")

    @silent
    def potential(self, a: BodyView, b: BodyView) -> Any:
        """Potential energy [J] of each pair, shape (pairs, 1). Optional; without it the law's work is reported."""
        raise LawDefinitionError(f"{type(self).__name__}: write potential(self, a, b)")


def _length(value: Any, label: str) -> float:
    """``value`` of ``cutoff``, checked."""
    if value is None:
        return math.inf
    try:
        found = math.nan if isinstance(value, (bool, str)) else float(value)
    except (TypeError, ValueError):
        found = math.nan
    if not found > 0.0:
        raise LawDefinitionError(
            f"{label}.cutoff = {value!r}: a length above 0 m is needed, or math.inf for none; of a parameter: "
            'cutoff = Param(2.5, unit="m", gt=0)'
        )
    return found


def _pairs(pairs: Any, label: str) -> tuple[tuple[PhysicalObject, PhysicalObject], ...]:
    """``pairs`` as a tuple of tuples of two different objects, none twice."""
    from xpheve.objects import PhysicalObject

    found = []
    seen: set[frozenset[PhysicalObject]] = set()
    given: list[Any] = list(pairs) if isinstance(pairs, Iterable) else [None]
    if not all(isinstance(pair, Iterable) for pair in given):
        raise InvalidValueError(f"{label}: pairs = {repr(pairs)[:200]}: a list of pairs of objects is needed")
    for k, pair in enumerate(tuple(one) for one in given):
        if len(pair) != 2 or not all(isinstance(obj, PhysicalObject) for obj in pair):
            raise InvalidValueError(f"{label}: pairs[{k}] = {pair!r}: two objects are needed")
        a, b = pair
        if a is b:
            raise InvalidValueError(f"{label}: pairs[{k}] joins {a!r} with itself: two different objects are needed")
        if frozenset(pair) in seen:
            raise InvalidValueError(
                f"{label}: pairs[{k}] = {pair!r} was given before: give each pair once, in one order"
            )
        seen.add(frozenset(pair))
        found.append((a, b))
    return tuple(found)


def _sides(between: Any, label: str) -> tuple[tuple[PhysicalObject, ...], tuple[PhysicalObject, ...]]:
    """``between`` as two tuples of objects."""
    from xpheve.objects import PhysicalObject

    try:
        these, those = (side if isinstance(side, Iterable) else (side,) for side in between)
        sides = tuple(these), tuple(those)
    except (TypeError, ValueError):
        sides = ((None,), (None,))
    if not all(isinstance(obj, PhysicalObject) for side in sides for obj in side):
        raise InvalidValueError(f"{label}: between = {between!r}: two objects, or two lists of objects, are needed")
    return sides
