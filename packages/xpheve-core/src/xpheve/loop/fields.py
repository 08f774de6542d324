"""Text of the part of a loop that moves rows: forces of field laws, the kick, the drift.

One step of length h, for every row, is drift-kick-drift with the kick by the midpoint rule (Hairer, Lubich, Wanner, Geometric
Numerical Integration, I.1.4 and II.5):

    m = x + h/2 v;   F(m, v) gives v' = v + h/2 a;   F(m, v') gives a;   x += h (v + h/2 a);   v += h a

Forces without velocities are found once. Sums of x, v and work keep their remainders (Knuth's two-sum; TAOCP 2, 4.2.2). In the last step
of a call only a is found: its flight is under way, and ends when somebody asks for more.

Where rows turn, M is their angular momentum, q their orientation (`xpheve.kernels.spin`):

    q1 = q turned by h/2;   T(m, v, q1, w1) gives w1' = w1 + h/2 T/J;   T(m, v', q1, w1') gives T;   M += h T;   q = q1 turned by h/2
"""

from __future__ import annotations

from collections.abc import Sequence

from xpheve.loop.terms import LANES, Slots, Term, depends, rowwise, shared_nodes, slot_of, summation_order
from xpheve.trace.emit import Writer
from xpheve.trace.graph import Node

AXES = "xyz"
H, ORIGIN, UP, PARAMETERS = 0, 1, 3, 6
"""Where the length of a step, the origin of the grid (two floats), the scene's up and the first law's parameters lie in the parameter table."""


class FieldText:
    """Writes function ``fields_<number>`` for rows that obey ``terms``, in this order.

    ``turning`` says that the rows turn in steps, too. `xpheve.loop.array_fields` writes the same for NumPy.
    """

    arrays = False

    def __init__(
        self, number: int, terms: Sequence[Term], slots: Slots, stored_work: bool, turning: bool = False
    ) -> None:
        self.turning = turning
        self.number, self.terms, self.slots = number, terms, slots
        self.stored_work = stored_work
        self.pulled, self.pushed = "pull" in slots.first, "push" in slots.first
        self.head: list[str] = []
        """Once a call: parameters and what depends on them alone."""
        self.tick: list[str] = []
        """Once a step: what depends on time alone."""
        self.body: list[str] = []
        """Once a row and step."""
        self._loaded: dict[str, str] = {}
        self.writers: list[Writer] = []
        offset = 0
        for k, term in enumerate(terms):
            self.writers.append(self._writer(k, term, offset))
            offset += term.size
        self.working = stored_work or bool(slots.pair_work) or any(not term.accounted for term in terms)

    @property
    def reads_time(self) -> bool:
        """Whether a law reads the time."""
        return any("time" in term.trace.reads for term in self.terms)

    @property
    def of_velocity(self) -> bool:
        """Whether a force depends on the velocity."""
        return any(term.of_velocity for term in self.terms)

    # What a node is called

    def _writer(self, k: int, term: Term, offset: int) -> Writer:
        """A writer for term ``k`` that knows already what is the same for all rows."""
        names = {one: f"k{k}_{m}" for m, one in enumerate(term.trace.parameters)}
        self.head += [f"{names[one]} = p[q + {offset + m}]" for m, one in enumerate(term.trace.parameters)]
        if term.switch:
            self.head.append(f"on_{k} = p[q + {offset + len(names)}]")

        def leaf(node: Node) -> str:
            if node.op == "param":
                return names[node.value]
            _, name, component = node.value
            if name == "time":
                return "now"
            if name == "up":
                return f"p[{UP + component}]"
            if name == "position":
                return f"m{AXES[component]}"
            if name == "velocity":
                return f"v{AXES[component]}"
            if self.turning and name == "orientation":
                return f"turn_q[{component}]"
            if self.turning and name == "angular_velocity":
                return f"turn_w[{component}]"
            return self._column(name, self._age_of(k) if name == "since" else component)

        outputs = self._outputs(term)
        timely, own = depends(outputs, ("time",)), rowwise(outputs)
        fixed = Writer(leaf, prefix=f"f{k}_", starts=self.slots.starts)
        fixed.write(shared_nodes(outputs, own | timely))
        self.head += fixed.lines
        later = Writer(leaf, prefix=f"g{k}_", starts=self.slots.starts)
        later.names.update(fixed.names)
        later.write(shared_nodes(outputs, own))
        self.tick += later.lines
        writer = Writer(leaf, self.arrays, prefix=f"a{k}_", starts=self.slots.starts)
        writer.names.update(later.names)
        return writer

    def _age_of(self, k: int) -> int:
        """Which of the row's numbers "since" is term ``k``'s: each law has its own."""
        return sum("since" in term.trace.reads for term in self.terms[:k])

    def _outputs(self, term: Term) -> list[Node]:
        """What is found of ``term``: its force, and its torque where rows turn."""
        return term.trace.motion if self.turning else list(term.trace.force or ())

    def _column(self, name: str, component: int) -> str:
        """The variable that holds a number of the row; loaded at its first use."""
        variable = f"c{component}_{name}"
        if variable not in self._loaded:
            self._loaded[variable] = variable
            self.body.append(f"{variable} = {self.load(slot_of(name), component)}")
        return variable

    def load(self, name: str, component: int = 0) -> str:
        """A number of the row, where it lies."""
        return f"s[i + {self.slots.at(name, component)}]"

    def store(self, name: str, component: int, value: str) -> None:
        self.body.append(f"{self.load(name, component)} = {value}")

    # One row

    def _forces(self, stage: int, which: Sequence[int]) -> dict[int, list[str]]:
        """Write the forces of terms ``which``; the names of their components. At stage 2 velocities are those of the middle.

        Torques come into ``self.twists``.
        """
        found = {}
        for k in which:
            term, writer = self.terms[k], self.writers[k]
            outputs = self._outputs(term)
            if stage == 2:
                speeds = {"velocity": [f"u{axis}" for axis in AXES]}
                if self.turning:
                    speeds["angular_velocity"] = [f"turn_u[{c}]" for c in range(3)]
                moved = depends(outputs, tuple(speeds))
                writer.names = {index: name for index, name in writer.names.items() if index not in moved}
                inputs = {
                    n.index: speeds[n.value.name][n.value.component]
                    for n in term.trace.graph.nodes
                    if n.op == "input" and n.value.name in speeds
                }
                writer.names.update(inputs)
                writer.prefix = f"b{k}_"
            at = len(writer.lines)
            names = writer.write(outputs)
            self.body += writer.lines[at:]
            if term.switch:
                names = self._switched(k, stage, names)
            if term.trace.force is not None:
                found[k] = names[:3]
            if self.turning and term.trace.torque is not None:
                self.twists[k] = names[-3:]
        return found

    def _switched(self, k: int, stage: int, names: list[str]) -> list[str]:
        """The components, or 0 where the term is put out."""
        put = [f"o{k}{stage}_{c}" for c in range(len(names))]
        for new, old in zip(put, names, strict=True):
            self.body.append(f"{new} = {old} if on_{k} != 0.0 else 0.0")
        return put

    def _sum(self, prefix: str, parts: list[list[str]]) -> list[str]:
        """Variables that hold the sums of ``parts``, component by component."""
        names = [f"{prefix}{axis}" for axis in AXES]
        for c, name in enumerate(names):
            self.body.append(f"{name} = {' + '.join(part[c] for part in parts) if parts else '0.0'}")
        return names

    def _slot(self, name: str) -> list[str]:
        return [self.load(name, c) for c in range(3)]

    def _acceleration(self, prefix: str, force: list[str]) -> None:
        for c, axis in enumerate(AXES):
            self.body.append(f"{prefix}{axis} = w{axis} + {force[c]} * im")

    def _begin(self) -> None:
        """Place, velocity, what acts all the time, and the place in the middle."""
        for c, axis in enumerate(AXES):
            self.body += [f"x{axis} = {self.load('position', c)}", f"v{axis} = {self.load('velocity', c)}"]
            self.body += [f"w{axis} = {self.load('stored', c)}"]
        self.body.append(f"im = {self.load('inverse_mass')}")
        for axis in AXES:
            self.body.append(f"m{axis} = x{axis} + half * v{axis}")

    def _middle_velocity(self) -> None:
        for axis in AXES:
            self.body.append(f"u{axis} = v{axis} + half * d{axis}")

    def row(self, half_only: bool = False) -> list[str]:
        """The lines of one row and step. ``half_only``: only as far as the velocity of the middle, which is stored."""
        self.body = []
        self._loaded = {}
        self._begin()
        self.twists: dict[int, list[str]] = {}
        if self.turning:
            self._turn_half_way()
        order = summation_order(self.terms)
        still = [k for k in order if not self.terms[k].of_velocity]
        moving = [k for k in order if self.terms[k].of_velocity]
        forces = self._forces(1, still)
        before = [[*([self._slot("pull")] if self.pulled else []), *(forces[k] for k in still if k in forces)]]
        if moving or self.pushed:
            if not self.pushed or half_only:
                first = forces | self._forces(1, moving)
                push = [self._slot("push")] if self.pushed else []
                self._acceleration("d", self._sum("e", before[0] + push + [first[k] for k in moving if k in first]))
                self._middle_velocity()
                if self.turning:
                    self._spin_half_way("u", self._torque())
                if half_only:
                    for c, axis in enumerate(AXES):
                        self.store("middle_velocity", c, f"u{axis}")
                        if self.turning:
                            self.store("middle_spin", c, f"turn_u[{c}]")
                    return self.body
            else:
                for c, axis in enumerate(AXES):
                    self.body.append(f"u{axis} = {self.load('middle_velocity', c)}")
                if self.turning:
                    self.body.append(f"turn_u = ({', '.join(self._slot('middle_spin'))})")
            forces |= self._forces(2, moving)
        push = [self._slot("push")] if self.pushed else []
        total = self._sum("e", before[0] + push + [forces[k] for k in moving if k in forces])
        self._acceleration("a", total)
        self._finish(total, [forces[k] for k in order if k in forces and not self.terms[k].accounted])
        if self.turning:
            self._turn_on(self._torque())
        return self.body

    # Rotation

    def _vector(self, name: str, count: int = 3) -> str:
        return f"({', '.join(self.load(name, c) for c in range(count))})"

    def _turn_half_way(self) -> None:
        """Orientation and angular velocity in the middle, of the latter what stored torques make of it."""
        self.body += [
            f"turn_0 = {self._vector('orientation', 4)}",
            f"spread = {self._vector('spread')}",
            f"inverse = {self.load('inverse_moment')}",
            f"twist = {self._vector('stored_torque')}",
            f"turn_m = spin__stretched(turn_0, {self._vector('angular_velocity')}, {self._vector('excess')})",
            "turn_q = spin__turned(turn_0, turn_m, spread, half)",
        ]
        self._spin_half_way("w", [f"twist[{c}]" for c in range(3)])

    def _spin_half_way(self, name: str, torque: list[str]) -> None:
        kick = ", ".join(f"{one} * inverse" for one in torque)
        self.body.append(f"turn_{name} = spin__stretched(turn_q, spin__kicked(turn_m, ({kick}), half), spread)")

    def _torque(self) -> list[str]:
        """Variables that hold the whole torque."""
        parts = [[f"twist[{c}]" for c in range(3)], *(self.twists[k] for k in sorted(self.twists))]
        return self._sum("r", parts)

    def _turn_on(self, torque: list[str]) -> None:
        """The torque is kept; but in the last step of a call, rotation goes on to the end of the step."""
        for c in range(3):
            self.store("torque", c, torque[c])
        kick = ", ".join(f"{one} * inverse" for one in torque)
        self.body += [
            "if g != 0.0:",
            f"    turn_m = spin__kicked(turn_m, ({kick}), g)",
            "    turn_q = spin__turned(turn_q, turn_m, spread, half)",
            "    turn_w = spin__stretched(turn_q, turn_m, spread)",
        ]
        self.body += [f"    {self.load('orientation', c)} = turn_q[{c}]" for c in range(4)]
        self.body += [f"    {self.load('angular_velocity', c)} = turn_w[{c}]" for c in range(3)]

    def _finish(self, total: list[str], working: list[list[str]]) -> None:
        """Drift and kick by ``g``, which is h, or 0 in the last step of a call; what the row keeps is stored."""
        for c, axis in enumerate(AXES):
            self.store("acceleration", c, f"a{axis}")
        for axis in AXES:
            self.body.append(f"d{axis} = g * (v{axis} + gh * a{axis})")
        if self.working:
            names = self._sum("z", [*(self._slot(name) for name in self.slots.pair_work), *working])
            for c in range(3):
                self.store("working", c, names[c])
            if self.stored_work:
                names = self._sum("z", [names, self._slot("stored_working")])
            self.body.append(f"j = zx * dx + zy * dy + zz * dz + {self.load('work_rest')}")
            self._two_sum("work", 0, self.load("work"), "j")
        for c, axis in enumerate(AXES):
            self.body.append(f"j = d{axis} + {self.load('position_rest', c)}")
            self._two_sum("position", c, f"x{axis}", "j")
            self.body.append(f"j = g * a{axis} + {self.load('velocity_rest', c)}")
            self._two_sum("velocity", c, f"v{axis}", "j")

    def _two_sum(self, name: str, component: int, old: str, more: str) -> None:
        """``old + more`` into slot ``name``, and what rounding lost into its rest."""
        if "s[" in old:
            self.body.append(f"y = {old}")
            old = "y"
        self.body += [f"t = {old} + {more}", f"b = t - {old}"]
        self.store(f"{name}_rest", component, f"({old} - (t - b)) + ({more} - b)")
        self.store(name, component, "t")

    # The function

    def function(self, half_only: bool = False) -> list[str]:
        """The lines of ``fields_<number>``, or of ``halves_<number>``."""
        name = "halves" if half_only else "fields"
        return self._around(name, self.row(half_only))

    def _around(self, name: str, body: list[str]) -> list[str]:
        """The function about the lines of one row and step."""
        head = [
            f"def {name}_{self.number}(s, p, tables, first, last, lanes_of_last, q, step, stop, steps, number):",
            "    h = p[0]",
            "    half = 0.5 * h",
        ]
        head += [f"    {line}" for line in self.head]
        tick = ["g = h if k < steps - 1 else 0.0", "gh = 0.5 * g"]
        if self.reads_time:
            tick.append(f"now = clock__later(clock__multiple((p[{ORIGIN}], p[{ORIGIN + 1}]), number + k, h), half)[0]")
        tick += self.tick
        return [*head, *self._loops(tick, body), "    return 0", ""]

    def _loops(self, tick: list[str], body: list[str]) -> list[str]:
        """Tiles, steps, lanes: the numbers of a tile stay in the cache for all steps."""
        lines = ["    for tile in range(first, last):", f"        base = tile * {self.slots.width * LANES}"]
        lines += [
            f"        lanes = {LANES} if tile < last - 1 else lanes_of_last",
            "        for k in range(step, stop):",
        ]
        lines += [f"            {line}" for line in tick]
        lines += ["            for i in range(base, base + lanes):", *(f"                {line}" for line in body)]
        return lines
