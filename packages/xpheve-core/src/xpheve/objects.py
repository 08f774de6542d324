"""PhysicalObject: a handle on a row of an engine's bodies; before and after that it owns its state itself."""

from __future__ import annotations

import copy
import math
import warnings
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from xpheve.errors import InvalidValueError, LawDefinitionError, OwnershipError, StaleHandleError, XpheveWarning
from xpheve.forces import Force, Vec, vector
from xpheve.shapes.base import Shape

if TYPE_CHECKING:
    from xpheve.laws.law import PhysicalLaw

Quat = tuple[float, float, float, float]

FIXED_STAYS = (
    "cannot be changed in an engine, for laws were planned without it; hold it where it is with obj.hold(), or "
)
"""Why ``fixed`` is not set live, and what is there instead."""

NOWHERE = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
FIELDS = ("position", "velocity", "orientation", "angular_velocity", "mass", "inertia")


REFUSED = {
    "update": "Write a FieldLaw or PairLaw for what acts all the time, or a PhysicalLaw under a condition such as "
    "xpheve.when.Elapsed, Changed or ContactBegin for what happens at an event, and map the object to it; other methods are your own",
}
"""Methods of the thesis's objects that the engine would never call, with the way out."""


def quaternion(value: Any, what: str) -> Quat:
    """``value`` as a unit quaternion (w, x, y, z); scaled to length 1 unless it has it to rounding."""
    try:
        w, x, y, z = (float(component) for component in value)
    except (TypeError, ValueError):
        raise InvalidValueError(f"{what} = {value!r}: four numbers (w, x, y, z) are needed") from None
    square = w * w + x * x + y * y + z * z
    if not 1e-200 < square < 1e200:
        raise InvalidValueError(f"{what} = {(w, x, y, z)}: a finite quaternion other than 0 is needed")
    if abs(square - 1.0) > 4e-16:
        length = math.sqrt(square)
        w, x, y, z = w / length, x / length, y / length, z / length
    return w + 0.0, x + 0.0, y + 0.0, z + 0.0


def positive_mass(value: Any, what: str) -> float:
    """``value`` as a finite mass above 0; raises `InvalidValueError`."""
    try:
        mass = float(value)
    except (TypeError, ValueError):
        raise InvalidValueError(f"{what} = {value!r}: a number of kilograms is needed") from None
    if not 0 < mass < math.inf:
        raise InvalidValueError(f"{what} = {mass}: a finite mass above 0 kg is needed; what never moves has fixed=True")
    return mass


def principal_moments(value: Any, what: str) -> Vec:
    """``value`` as principal moments of inertia; one number stands for three equal ones."""
    if isinstance(value, (int, float)):
        value = (value, value, value)
    a, b, c = moments = vector(value, what)
    if min(moments) < 0 or (min(moments) == 0 and max(moments) > 0):
        raise InvalidValueError(f"{what} = {moments}: principal moments [kg m^2] are all above 0, or all 0 for a point")
    if max(a - b - c, b - c - a, c - a - b) > 1e-9 * max(moments):
        raise InvalidValueError(
            f"{what} = {moments}: no body has these principal moments, the largest is more than the sum of the others; "
            "give them along the body's principal axes"
        )
    return moments


class PhysicalObject:
    """What moves as one: pose, velocity, mass, shape, and columns that laws ask for.

    Parameters
    ----------
    shape
        A `xpheve.shapes.Shape`, or None for a point.
    mass, density
        Mass [kg], default that of densities given to parts, or 1; or density [kg/m^3] of the shape.
    position, velocity
        Of the centre of mass [m], [m/s]; shape (3,), world frame.
    orientation
        Quaternion (w, x, y, z), body to world.
    angular_velocity
        [rad/s], shape (3,), world frame.
    inertia
        Principal moments [kg m^2] about the body's x, y, z; by default those of the solid shape.
    pose
        Instead of position and orientation, the pose (4, 4) of the frame in which the shape was authored, body to world.
    fixed
        Never moves, whatever acts on it.
    name
        For files and listings; unique in an engine if not empty.
    **columns
        Values of columns that laws declare, such as ``restitution=0.5``.

    Raises
    ------
    InvalidValueError
        If a value is not finite, of the wrong shape, or no body could have it.
    """

    __slots__ = (
        "__weakref__",
        "_columns",
        "_density",
        "_driven",
        "_engine",
        "_fixed",
        "_name",
        "_own",
        "_row",
        "_shape",
        "rank",
        "serial",
    )

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        for name in REFUSED:
            if name in cls.__dict__:
                raise LawDefinitionError(
                    f"{cls.__name__} defines {name}: objects hold state, and the engine moves them, so nobody would call it. {REFUSED[name]}"
                )

    def __init__(
        self,
        shape: Shape | None = None,
        *,
        mass: float | None = None,
        position: Sequence[float] = (0.0, 0.0, 0.0),
        velocity: Sequence[float] = (0.0, 0.0, 0.0),
        orientation: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
        angular_velocity: Sequence[float] = (0.0, 0.0, 0.0),
        inertia: float | Sequence[float] | None = None,
        density: float | None = None,
        pose: Any = None,
        fixed: bool = False,
        name: str = "",
        **columns: float,
    ) -> None:
        label = f"object {name!r}" if name else "object"
        if shape is not None and not isinstance(shape, Shape):
            raise InvalidValueError(f"{label}: shape = {shape!r} is no shape; give one such as xpheve.Sphere(0.1)")
        if not isinstance(name, str):
            raise InvalidValueError(f"{label}: name = {name!r}: a text is needed")
        self._engine: Any = None
        self._row = -1
        self.serial = -1
        self.rank = -1
        self._shape = shape
        self._fixed = bool(fixed)
        self._driven = False
        self._name = name
        self._columns = _check_columns(columns, label)
        self._check_solid(mass, inertia, label)
        mass = self._mass_of(mass, density, label)
        self._density = None if density is None else float(density)
        if inertia is None:
            inertia = moments_of(shape, mass)
        if pose is not None:
            if tuple(position) != NOWHERE[0] or tuple(orientation) != NOWHERE[1]:
                raise InvalidValueError(f"{label}: pose= and position= or orientation=: give one of them")
            position, orientation = self._body_pose(pose, f"{label}: pose")
        if shape is not None and math.isinf(shape.reach) and not fixed:
            raise InvalidValueError(f"{label}: a {shape.kind} has no end, so it cannot move: say fixed=True")
        self._own: dict[str, Any] = {
            "position": vector(position, f"{label}: position"),
            "velocity": vector(velocity, f"{label}: velocity"),
            "orientation": quaternion(orientation, f"{label}: orientation"),
            "angular_velocity": vector(angular_velocity, f"{label}: angular_velocity"),
            "mass": mass,
            "inertia": principal_moments(inertia, f"{label}: inertia"),
        }
        if fixed and (any(self._own["velocity"]) or any(self._own["angular_velocity"])):
            raise InvalidValueError(f"{label}: fixed=True, yet it has a velocity; what moves is not fixed")

    def _check_solid(self, mass: float | None, inertia: Any, label: str) -> None:
        """Refuse a moving object whose mass properties nobody can tell."""
        shape = self._shape
        if shape is not None and not shape.solid and not self._fixed and (mass is None or inertia is None):
            raise InvalidValueError(f"{label}: {shape.why_hollow()}")

    def _mass_of(self, mass: float | None, density: float | None, label: str) -> float:
        if density is None:
            natural = None if self._shape is None else self._shape.mass
            return positive_mass((1.0 if natural is None else natural) if mass is None else mass, f"{label}: mass")
        if mass is not None:
            raise InvalidValueError(f"{label}: mass = {mass} and density = {density}: give one of them")
        if self._shape is not None and self._shape.mass is not None:
            raise InvalidValueError(
                f"{label}: density = {density}, yet the parts have densities: give one or the other"
            )
        if self.shape is None or math.isinf(self.shape.volume) or not self.shape.solid:
            raise InvalidValueError(f"{label}: density = {density} needs a shape with a volume; give mass")
        return positive_mass(
            positive_mass(density, f"{label}: density") * self.shape.volume, f"{label}: density * volume"
        )

    def __repr__(self) -> str:
        label = f" {self.name!r}" if self.name else (f" #{self.serial}" if self.serial >= 0 else "")
        shape = f" {self.shape!r}" if self.shape is not None else ""
        return f"<PhysicalObject{label}{shape}{' fixed' if self.fixed else ' driven' if self._driven else ''}>"

    @property
    def name(self) -> str:
        """For files and listings; fixed once the object is in an engine."""
        return self._name

    @name.setter
    def name(self, value: str) -> None:
        if self._engine is not None:
            raise InvalidValueError(f"{self!r}: name = {value!r}: an object in an engine keeps its name")
        if not isinstance(value, str):
            raise InvalidValueError(f"{self!r}: name = {value!r}: a text is needed")
        self._name = value

    @property
    def shape(self) -> Shape | None:
        """The shape, or None for a point.

        A new one takes effect at this instant: bounds and contacts follow; the mass if it was given as a density; the inertia if it was
        that of the solid shape. A mass or inertia given by hand stays. In a handler: at the end of the instant.
        """
        return self._shape

    @shape.setter
    def shape(self, value: Shape | None) -> None:
        if value is not None and not isinstance(value, Shape):
            raise InvalidValueError(f"{self!r}: shape = {value!r} is no shape; give one such as xpheve.Sphere(0.1)")
        if value is not None and math.isinf(value.reach) and not self.fixed:
            raise InvalidValueError(
                f"{self!r}: a {value.kind} has no end, so it cannot move: only fixed objects have one"
            )
        engine = self._home()
        if engine is not None:
            engine.set_shape(self, value)
            return
        mass = mass_with(self, value)
        inertia = inertia_with(self, value, mass)
        self._own["mass"], self._own["inertia"], self._shape = mass, inertia, value

    @property
    def fixed(self) -> bool:
        """Whether the object never moves; that of an object in an engine stays."""
        return self._fixed

    @fixed.setter
    def fixed(self, value: bool) -> None:
        self._refuse_in_engine("fixed", value)
        if value and (any(self._own["velocity"]) or any(self._own["angular_velocity"])):
            raise InvalidValueError(f"{self!r}: fixed=True, yet it has a velocity; what moves is not fixed")
        self._fixed = bool(value)

    def _refuse_in_engine(self, what: str, value: Any) -> None:
        if self._engine is not None:
            raise InvalidValueError(
                f"{self!r}: {what} = {value!r}: {FIXED_STAYS}remove the object, change it, and add it again"
            )

    @property
    def label(self) -> str:
        """The name, or the serial number for an object that has none."""
        return self.name or f"#{self.serial}"

    def __copy__(self) -> PhysicalObject:
        """A free object with the same state, columns and name, in no engine, without forces, and driven by nobody.

        What a subclass keeps in attributes is copied as `copy.copy` does, one level deep; its ``__init__`` is not called.
        """
        found = _rebuilt(*self.__reduce__()[1])
        if hasattr(self, "__dict__"):
            found.__dict__.update(self.__dict__)
        return found

    def __deepcopy__(self, memo: dict[int, Any]) -> PhysicalObject:
        found = _rebuilt(*self.__reduce__()[1])
        memo[id(self)] = found
        if hasattr(self, "__dict__"):
            found.__dict__.update(copy.deepcopy(self.__dict__, memo))
        return found

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled as `copy.copy` makes it: free, without forces."""
        state = {field: self._get(field) for field in FIELDS}
        made = (type(self), self.shape, self.fixed, self.name, state, self.columns, self._density)
        return _rebuilt, made, (getattr(self, "__dict__", None) or None)

    # The state, read and written wherever it lives

    def _home(self) -> Any:
        engine = self._engine
        if engine is not None and not engine.owns(self):
            raise StaleHandleError(
                f"{self!r}: its row now belongs to another object; take the handle from engine.objects"
            )
        return engine

    def _get(self, name: str) -> Any:
        engine = self._home()
        return self._own[name] if engine is None else engine.read_object(self, name)

    def _set(self, name: str, value: Any) -> None:
        engine = self._home()
        if self.fixed and name in ("velocity", "angular_velocity") and any(value):
            raise InvalidValueError(f"{self!r} is fixed: its {name} cannot be {value}")
        if engine is None:
            self._own[name] = value
        else:
            engine.write_object(self, name, value)

    @property
    def position(self) -> Vec:
        """Position [m] of the centre of mass, world frame."""
        found: Vec = self._get("position")
        return found

    @position.setter
    def position(self, value: Sequence[float]) -> None:
        self._set("position", vector(value, f"{self!r}: position"))

    @property
    def velocity(self) -> Vec:
        """Velocity [m/s] of the centre of mass, world frame."""
        found: Vec = self._get("velocity")
        return found

    @velocity.setter
    def velocity(self, value: Sequence[float]) -> None:
        self._set("velocity", vector(value, f"{self!r}: velocity"))

    @property
    def orientation(self) -> Quat:
        """Unit quaternion (w, x, y, z), body to world."""
        found: Quat = self._get("orientation")
        return found

    @orientation.setter
    def orientation(self, value: Sequence[float]) -> None:
        self._set("orientation", quaternion(value, f"{self!r}: orientation"))

    @property
    def pose(self) -> Any:
        """Pose of the frame in which the shape was authored: a matrix (4, 4), authored to world, made anew each time.

        For shapes such as spheres and boxes that is the frame of ``position`` and ``orientation``. Raises `InvalidValueError`
        when set to a matrix with scale, shear or reflection.
        """
        from xpheve.orientation import compose, to_pose

        own = self.position, self.orientation
        return to_pose(*(own if self._shape is None else compose(own, self._shape.frame)))

    @pose.setter
    def pose(self, value: Any) -> None:
        self.position, self.orientation = self._body_pose(value, f"{self!r}: pose")

    def _body_pose(self, pose: Any, what: str) -> tuple[Vec, Quat]:
        """Position and orientation of the body where the authored frame has ``pose``."""
        from xpheve.orientation import compose, from_pose, inverse

        authored = from_pose(pose, what)
        return authored if self._shape is None else compose(authored, inverse(self._shape.frame))

    @property
    def angular_velocity(self) -> Vec:
        """Angular velocity [rad/s], world frame."""
        found: Vec = self._get("angular_velocity")
        return found

    @angular_velocity.setter
    def angular_velocity(self, value: Sequence[float]) -> None:
        self._set("angular_velocity", vector(value, f"{self!r}: angular_velocity"))

    @property
    def mass(self) -> float:
        """Mass [kg]. Setting it corrects the forces that laws stored; a density given before is forgotten.

        Moments of inertia that are those of the solid shape follow; others were given by hand and stay.
        """
        return float(self._get("mass"))

    @mass.setter
    def mass(self, value: float) -> None:
        mass = positive_mass(value, f"{self!r}: mass")
        inertia = inertia_with(self, self._shape, mass)
        turns = self.inertia != inertia
        self._set("mass", mass)
        if turns:
            self._set("inertia", inertia)
        self._density = None

    @property
    def inertia(self) -> Vec:
        """Principal moments of inertia [kg m^2] about the body's axes."""
        found: Vec = self._get("inertia")
        return found

    @inertia.setter
    def inertia(self, value: float | Sequence[float]) -> None:
        self._set("inertia", principal_moments(value, f"{self!r}: inertia"))

    # Columns that laws declare

    @property
    def columns(self) -> dict[str, float]:
        """The columns that were given values, by name."""
        return dict(self._columns)

    def __getitem__(self, name: str) -> float:
        engine = self._home()
        if name in self._columns and (engine is None or engine.is_mine):
            return self._columns[name]
        if engine is not None:
            return float(engine.read_column(self, name))
        raise KeyError(f"{self!r} was given no column {name!r}")

    def __setitem__(self, name: str, value: float) -> None:
        checked = _check_columns({name: value}, repr(self))
        engine = self._home()
        if engine is None:
            self._columns.update(checked)
        else:
            engine.write_column(self, name, checked[name])

    def __getattr__(self, name: str) -> float:
        if not name.startswith("_"):
            try:
                return self[name]
            except (KeyError, InvalidValueError):
                pass
        raise AttributeError(f"{type(self).__name__} has no attribute or column {name!r}{_way_to(name)}")

    # The host's hand

    @property
    def driven(self) -> bool:
        """Whether the host prescribes how the object moves: then no law, force or impact changes its motion."""
        return self._driven

    def hold(self) -> None:
        """Let the object stand where it is, whatever acts on it, until it is carried, driven or released.

        Forces and laws on it wait, and act again when it is released; the time of forces that have a duration goes on.

        Raises
        ------
        OwnershipError
            If the object is in no engine.
        InvalidValueError
            If it is fixed.
        """
        self._in_engine("hold").hold(self)

    def drive(self, velocity: Sequence[float] | None = None, angular_velocity: Sequence[float] | None = None) -> None:
        """Let the object move at ``velocity`` [m/s] and turn at ``angular_velocity`` [rad/s], shape (3,), world frame, whatever acts on it.

        What is left out stays as it is. Raises as `hold`, and `InvalidValueError` for what is not finite.
        """
        engine = self._in_engine("drive")
        engine.drive(self, *self._motion("drive", velocity, angular_velocity))

    def carry(
        self,
        position: Sequence[float] | None = None,
        orientation: Sequence[float] | None = None,
        *,
        within: float,
    ) -> None:
        """Move the object uniformly so that it is at ``position`` [m] and ``orientation`` after ``within`` [s], and let it stand there.

        It goes straight and turns the shorter way at constant velocity and angular velocity, so what it meets on its way meets it at an
        exact instant. What is left out stays. The next call takes the place of this one. Setting its state ends the way, not the hold.

        Raises
        ------
        OwnershipError
            If the object is in no engine.
        InvalidValueError
            If it is fixed, nothing is asked for, a number is not finite, or ``within`` is not above 0 s.
        """
        engine = self._in_engine("carry")
        if position is None and orientation is None:
            raise InvalidValueError(
                f"{self!r}: carry: say where: position, orientation, or both; obj.hold() holds it here"
            )
        try:
            span = float(within)
        except (TypeError, ValueError):
            span = math.nan
        if not 0.0 < span < math.inf:
            raise InvalidValueError(
                f"{self!r}: carry: within = {within!r}: a finite time above 0 s is needed; to put it there at once, set obj.position"
            )
        engine.carry(
            self,
            None if position is None else vector(position, f"{self!r}: carry: position"),
            None if orientation is None else quaternion(orientation, f"{self!r}: carry: orientation"),
            span,
        )

    def release(self, velocity: Sequence[float] | None = None, angular_velocity: Sequence[float] | None = None) -> None:
        """Let the object go with the velocities it has, or those given. Raises `StateError` if nobody holds it."""
        engine = self._in_engine("release")
        engine.release(self, *self._motion("release", velocity, angular_velocity))

    def _motion(self, call: str, velocity: Any, turning: Any) -> tuple[Vec | None, Vec | None]:
        return (
            None if velocity is None else vector(velocity, f"{self!r}: {call}: velocity"),
            None if turning is None else vector(turning, f"{self!r}: {call}: angular_velocity"),
        )

    # Forces and laws

    @property
    def forces(self) -> tuple[Force, ...]:
        """The forces that act now: the user's and those that laws stored, with the time each still has."""
        engine = self._home()
        return () if engine is None else engine.forces_of(self)

    def add_force(
        self, force: Force | Sequence[float], duration: float = math.inf, id: int | str | None = None
    ) -> Force:
        """Let a force act from now on; returns it with its id.

        Raises
        ------
        OwnershipError
            If the object is in no engine.
        InvalidValueError
            If the force is not finite, its duration negative, or it turns an object that has no inertia.
        """
        engine = self._in_engine("add_force")
        given = force if isinstance(force, Force) else Force(force, duration, id)
        added: Force = engine.add_force(self, given)
        return added

    def remove_force(self, id: int | str) -> int:
        """Take away all forces of this object with ``id``; returns how many there were."""
        return int(self._in_engine("remove_force").remove_force(self, id))

    @property
    def laws(self) -> tuple[PhysicalLaw, ...]:
        """The laws the object obeys."""
        engine = self._home()
        return () if engine is None else engine.laws_of(self)

    @property
    def engine(self) -> Any:
        """The engine the object is in, or None."""
        return self._engine

    def _in_engine(self, call: str) -> Any:
        engine = self._home()
        if engine is None:
            raise OwnershipError(f"{self!r} is in no engine: add it with engine.add_object before {call}")
        return engine


def _rebuilt(
    kind: type[PhysicalObject],
    shape: Shape | None,
    fixed: bool,
    name: str,
    state: dict[str, Any],
    columns: dict[str, float],
    density: float | None = None,
) -> PhysicalObject:
    found = kind.__new__(kind)  # a subclass may ask its __init__ for anything
    PhysicalObject.__init__(found, shape, fixed=fixed, name=name, **(state | columns))
    found._density = density
    return found


def mass_with(obj: PhysicalObject, shape: Shape | None) -> float:
    """The mass [kg] of ``obj`` with ``shape``: by its density if it was given one, else the mass it has."""
    if obj._density is None:
        return obj.mass
    if shape is None or math.isinf(shape.volume):
        raise InvalidValueError(
            f"{obj!r}: shape = {shape!r} has no volume, and the mass comes from density = {obj._density} kg/m^3; "
            "set obj.mass first, then it stays"
        )
    return positive_mass(obj._density * shape.volume, f"{obj!r}: density * volume")


def inertia_with(obj: PhysicalObject, shape: Shape | None, mass: float) -> Vec:
    """The moments [kg m^2] of ``obj`` with ``shape``: those of the solid if they were so, else the ones it has."""
    if obj.inertia != moments_of(obj.shape, obj.mass):
        return obj.inertia
    return principal_moments(moments_of(shape, mass), f"{obj!r}: inertia of {shape!r}")


def moments_of(shape: Shape | None, mass: float) -> Vec:
    """Principal moments [kg m^2] that ``shape`` has by itself; zeros where it has none."""
    return (0.0, 0.0, 0.0) if shape is None or math.isinf(shape.reach) or not shape.solid else shape.inertia(mass)


ELSEWHERE = {
    "pos": "position=(x, y, z)",
    "vel": "velocity=(x, y, z)",
    "linear_velocity": "velocity=(x, y, z)",
    "angvel": "angular_velocity=(x, y, z)",
    "quat": "orientation=(w, x, y, z)",
    "quaternion": "orientation=(w, x, y, z)",
    "rotation": "orientation=(w, x, y, z); xpheve.orientation makes it of an axis and an angle",
    "static": "fixed=True",
    "is_static": "fixed=True",
    "kinematic": "obj.hold(), obj.drive(...) or obj.carry(...), once it is in an engine",
}
"""What other engines call a property: as a column it would be taken, and mean nothing."""

CALLS = {
    "apply_force": "obj.add_force(vector, duration)",
    "apply_torque": "obj.add_force(xpheve.Force(torque=...))",
    "add_torque": "obj.add_force(xpheve.Force(torque=...))",
    "apply_impulse": "obj.velocity = velocity + impulse / mass",
    "add_impulse": "obj.velocity = velocity + impulse / mass",
}


def _way_to(name: str) -> str:
    """What to write instead of the attribute ``name``, to put behind an error."""
    from xpheve.plugins.suggest import did_you_mean

    if name in CALLS or name in ELSEWHERE:
        return f"; here that is {CALLS.get(name) or ELSEWHERE[name]}"
    meant = did_you_mean(name, [known for known in dir(PhysicalObject) if not known.startswith("_")])
    return f".{meant}" if meant else ""


def warn_of_misspelt(obj: PhysicalObject, declared: Iterable[str]) -> None:
    """Warn (`XpheveWarning`) if ``obj`` was given what seems to misspell one of the columns that its laws ``declared``."""
    known = set(declared)
    for name in sorted(set(obj._columns) - known):
        for near in sorted(known - set(obj._columns)):
            if len(name) > 3 and _one_edit_apart(name, near):
                text = f"{obj!r}: no law of it reads column {name!r}; did you mean {near!r}?"
                warnings.warn(text, XpheveWarning, stacklevel=5)


def _check_columns(columns: dict[str, Any], label: str) -> dict[str, float]:
    checked = {}
    if "driven" in columns:
        raise InvalidValueError(
            f"{label}: driven is no column: add the object to an engine, then obj.hold() or obj.carry(...)"
        )
    for name, value in columns.items():
        if name in ELSEWHERE:
            raise InvalidValueError(f"{label}: {name} = {value!r}: here that is {ELSEWHERE[name]}")
        try:
            number = float(value)
        except (TypeError, ValueError):
            number = math.nan
        if not math.isfinite(number):
            from xpheve.plugins.suggest import did_you_mean

            hint = did_you_mean(name, [*FIELDS, "shape", "fixed", "name", "density"])
            raise InvalidValueError(f"{label}: column {name} = {value!r}: a finite number is needed.{hint}")
        if not hasattr(PhysicalObject, name) and name.isidentifier():
            near = _near_field(name)
            if near:
                raise InvalidValueError(f"{label}: no property {name!r}; did you mean {near!r}?")
        checked[name] = number
    return checked


def _near_field(name: str) -> str:
    """The property of an object that ``name`` seems to misspell, or ``""``."""
    if name == "mask":
        return ""  # of collision groups, and not a slip of mass
    for known in (*FIELDS, "shape", "fixed", "density", "pose"):
        if name != known and len(name) > 2 and _one_edit_apart(name, known):
            return known
    return ""


def _one_edit_apart(a: str, b: str) -> bool:
    """Whether one letter left out, put in, changed, or two swapped, makes ``a`` to ``b``."""
    if abs(len(a) - len(b)) > 1:
        return False
    start = 0
    while start < min(len(a), len(b)) and a[start] == b[start]:
        start += 1
    x, y = a[start:], b[start:]
    return x[1:] == y or x == y[1:] or x[1:] == y[1:] or (x[2:] == y[2:] and x[:2] == y[1::-1])
