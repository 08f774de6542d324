"""The errors and warnings a user can meet.

Each names the thing, the value and the way out. Bad input raises before anything has changed.
"""

from __future__ import annotations


class XpheveError(Exception):
    """What every error of xPheve is; ``except XpheveError`` catches them all."""


class InvalidValueError(XpheveError, ValueError):
    """A value that cannot be: NaN, a negative mass, a zero normal, a wrong shape."""


class UnitError(InvalidValueError):
    """A quantity whose unit does not fit what it is given for."""


class ParameterError(InvalidValueError):
    """A law's parameter that is unknown, out of bounds, or of the wrong unit or shape."""


class StateError(XpheveError, RuntimeError):
    """A call that the engine's present state does not allow, such as ``run`` after ``terminate``."""


class StaleHandleError(StateError):
    """A handle whose row in the engine now belongs to another object, or to none."""


class OwnershipError(XpheveError, ValueError):
    """An object, law or container that belongs to another engine, or to none."""


class NotAcceptedError(XpheveError, TypeError):
    """A law put into a container that takes laws of another role."""


class UnknownLawError(XpheveError, LookupError):
    """A law, container, stepper or shape that no installed pack offers."""


class PackError(XpheveError):
    """A pack that cannot be used."""


class BrokenPackError(PackError):
    """A pack that failed while it was being loaded; the others go on."""


class IncompatiblePackError(PackError):
    """A pack made for another version of the law contract."""


class DuplicateLawError(PackError):
    """A pack name or an id that two distributions claim."""


class LawDefinitionError(PackError, TypeError):
    """A law class whose interface is wrong: no id, a bad unit, ``enforce`` overridden."""


class OrderError(XpheveError):
    """Laws whose ``before`` and ``after`` form a ring."""


class ConflictError(XpheveError):
    """Two laws that exclude one another on the same objects."""


class LawFailedError(XpheveError, RuntimeError):
    """A law that raised, or gave a value that is not finite, while the engine ran; ``law`` is that law."""

    def __init__(self, message: str, law: object = None) -> None:
        super().__init__(message)
        self.law = law


class NoStepperError(XpheveError):
    """Motion that no stepper at hand can follow."""


class ContactError(XpheveError):
    """A contact that no law or stepper at hand can resolve, such as a second support."""


class SceneError(XpheveError, ValueError):
    """A scene file that is wrong: place, value and way out."""


class MeshError(XpheveError, ValueError):
    """A mesh file, or a node of a scene graph, that cannot be used."""


class RecordError(XpheveError):
    """A record or checkpoint that cannot be read."""


class XpheveWarning(UserWarning):
    """What every warning of xPheve is; ``warnings.filterwarnings`` silences it by class."""


class ResolutionWarning(XpheveWarning):
    """Fixed steps are too long for the forces: the text says where, and which step would do."""


class OrderWarning(XpheveWarning):
    """Two laws that set the same thing of one object at one event, with no order between them."""


class MeshWarning(XpheveWarning):
    """A mesh that was mended: ``what`` it was, and ``repairs``, a sentence each."""

    def __init__(self, what: str, repairs: tuple[str, ...]) -> None:
        super().__init__(f"{what}: {'; '.join(repairs)}")
        self.what, self.repairs = what, repairs


class TraceError(LawDefinitionError):
    """A law whose expression cannot be traced; the message names the author's line and the way out."""


class DimensionError(TraceError):
    """A law that adds, compares or returns quantities that do not go together; the author's line is named."""


class TracedBranchError(TraceError):
    """A Python ``if``, ``while``, ``and`` or ``float()`` on a traced value, which is not a number yet."""


class CompileWarning(XpheveWarning):
    """Compiled code that could not be kept or read; the run goes on, slower to start."""


class PotentialError(TraceError):
    """A law whose potential and force do not belong together; the message has the state and both numbers."""


class CompileError(XpheveError):
    """A kernel file or a generated text that cannot be compiled; file, line and the way out are named."""
