"""LawContainer: *when*. It names a condition and holds the laws that answer it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from xpheve.errors import InvalidValueError, NotAcceptedError, ParameterError
from xpheve.laws.conditions import Condition
from xpheve.laws.event import Event
from xpheve.laws.law import PhysicalLaw
from xpheve.laws.param import Param

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject


class LawContainer:
    """A condition and the laws that are enforced when it fires, each once an event.

    Subclasses set ``condition`` and ``accepts``; one that overrides `detect` is polled instead of served.

    Parameters
    ----------
    condition
        In place of the class's own.
    name
        For listings and scene files.
    **parameters
        Values of the `Param` s of the class, as laws have them; those of a container in an engine stay.

    Raises
    ------
    ParameterError
        If a parameter is unknown or does not fit its declaration.
    """

    id: ClassVar[str] = ""
    condition: Condition | None = None
    accepts: ClassVar[type[PhysicalLaw]] = PhysicalLaw
    """Laws of this kind may be put in; others are refused."""
    accepts_role: ClassVar[str] = ""
    """If not empty, only laws of this role."""
    period: float | None = None
    """Time [s] between two calls of an overridden `detect`; None for the start of each host step."""
    periodic: ClassVar[bool] = True
    """Whether it finds its events in periodic scenes; one whose `detect` compares positions, and knows no images, says False."""
    params: ClassVar[dict[str, Param]] = {}
    span: float = 0.0
    """Time [s] from this call of `detect` to the next; set before each."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.params = cls.params | {name: value for name, value in cls.__dict__.items() if isinstance(value, Param)}

    def __init__(self, condition: Condition | None = None, *, name: str = "", **parameters: Any) -> None:
        self.parameters: dict[str, Any] = {key: param.default for key, param in self.params.items()}
        self.engine: Any = None
        for key, value in parameters.items():
            self.set_parameter(key, value)
        if condition is not None:
            if not isinstance(condition, Condition):
                raise InvalidValueError(
                    f"condition={condition!r}: give a wakeup condition such as xpheve.when.Elapsed(1.0)"
                )
            self.condition = condition
        self.name = name
        self.laws: list[PhysicalLaw] = []
        self.firings = 0
        self.detections = 0

    @classmethod
    def label(cls) -> str:
        """The id, or the class name of a container that has none."""
        return cls.id or cls.__name__

    def __repr__(self) -> str:
        named = f" {self.name!r}" if self.name else ""
        when = self.condition if self.condition is not None or not self.is_polled else "polled"
        return f"<{self.label()}{named}: {when}>"

    def set_parameter(self, name: str, value: Any) -> None:
        """Set parameter ``name`` of a container that is in no engine yet. Raises `ParameterError`."""
        if name not in self.params:
            raise ParameterError(
                f"{self.label()} has no parameter {name!r}; it has: {', '.join(self.params) or 'none'}"
            )
        if self.engine is not None:
            raise ParameterError(
                f"{self!r}: {name} = {value!r}: a container in an engine keeps its parameters; make another"
            )
        self.parameters[name] = self.params[name].check(value, self.label())

    def add_law(self, law: PhysicalLaw) -> None:
        """Put ``law`` in.

        Raises
        ------
        NotAcceptedError
            If the law is not of the kind or role that the container takes.
        """
        self.check(law)
        if self.engine is not None:
            self.engine.put_law(self, law)
        else:
            self.put(law)

    def put(self, law: PhysicalLaw) -> None:
        """For the engine: put ``law`` in, checked already."""
        if law not in self.laws:
            self.laws.append(law)
            law.containers.append(self)

    def check(self, law: PhysicalLaw) -> None:
        """Raise `NotAcceptedError` if the container does not take ``law``."""
        if not isinstance(law, PhysicalLaw):
            raise NotAcceptedError(f"{self.label()}: {law!r} is not a PhysicalLaw")
        if not law.in_containers:
            raise NotAcceptedError(
                f"{self.label()}: {law!r} acts all the time, and goes into no container: leave container=None"
            )
        wrong_role = self.accepts_role and law.role != self.accepts_role
        if not isinstance(law, self.accepts) or wrong_role:
            wanted = self.accepts.__name__ + (f" of role {self.accepts_role!r}" if self.accepts_role else "")
            raise NotAcceptedError(
                f"{self.label()} accepts {wanted}; {law.label()} is a {type(law).__mro__[1].__name__} of role "
                f"{law.role!r}. Put it into its own container: leave container=None"
            )

    def remove_law(self, law: PhysicalLaw) -> None:
        """Take ``law`` out; nothing happens if it is not in."""
        if self.engine is not None:
            self.engine.take_law_out(self, law)
        else:
            self.take_out(law)

    def take_out(self, law: PhysicalLaw) -> None:
        """For the engine: take ``law`` out."""
        if law in self.laws:
            self.laws.remove(law)
            law.containers.remove(self)

    def law_changed(self, law: PhysicalLaw, what: str, obj: PhysicalObject | None = None) -> None:
        """Told when ``law`` was enabled or disabled or gained or lost ``obj``; for subclasses."""

    def detect(self) -> Event | None:
        """Override to find events oneself: called at each host step, or each ``period``; returns the event, or None."""
        return None

    @property
    def is_polled(self) -> bool:
        """Whether the container overrides `detect`."""
        return type(self).detects()

    @classmethod
    def detects(cls) -> bool:
        """Whether containers of this class override `detect`, and so need no condition."""
        return cls.detect is not LawContainer.detect

    def enforce_laws(self, event: Event) -> None:
        """Enforce each enabled law once, in the order of the plan."""
        self.firings += 1
        for law in list(self.laws):
            law.enforce(event)
