"""Whatever is wrong with a scene file, one SceneError says where, what, and the way out; nothing is built."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from xpheve.errors import SceneError, XpheveWarning
from xpheve.plugins import Registry
from xpheve.scene import load, loads, model, source

HEAD = "xpheve = 1\n"
BALL = HEAD + '[[objects]]\nname = "ball"\n'
KEYS = (
    "Keys here: name, shape, mass, density, position, velocity, orientation, pose, angular_velocity, inertia, fixed, driven, arrival, "
    "columns, laws, forces"
)

# What is wrong: a text, and the error, or a part of it. Braces of the error are doubled nowhere: it is no format.
BAD = {
    "nan": (BALL + "mass = nan", 's:4: object "ball": mass = nan: a finite number in kg is needed'),
    "infinity": (
        BALL + "position = [0, inf, 0]",
        's:4: object "ball": position = [0, inf, 0]: a finite number in m is needed',
    ),
    "beyond floats": (
        BALL + "mass = 1" + "0" * 400,
        f's:4: object "ball": mass = 1{"0" * 56}...: a finite number in kg is needed',
    ),
    "thousands of digits": (BALL + "mass = " + "1" * 5000, "s: this is no TOML: Exceeds the limit (4300 digits)"),
    "negative mass": (
        BALL + "mass = -1.0",
        's:4: object "ball": mass = -1.0: a mass above 0 kg is needed; what never moves has fixed = true',
    ),
    "negative radius": (
        BALL + 'shape = { kind = "sphere", radius = -1 }',
        's:4: object "ball": shape.radius = -1: a number above 0 m is needed',
    ),
    "no radius": (BALL + 'shape = { kind = "sphere" }', 's:4: object "ball": shape: the key radius is missing'),
    "unknown shape": (
        BALL + 'shape = { kind = "spere", radius = 1 }',
        's:4: object "ball": shape.kind = "spere": no shape is called so. Did you mean "sphere"? '
        "Shapes: sphere, box, capsule, plane, compound, hull, mesh, or a pack's id",
    ),
    "shape without kind": (
        BALL + "shape = { radius = 1 }",
        's:4: object "ball": shape: the key kind is missing; shapes are sphere, box, capsule, plane',
    ),
    "shape no table": (
        BALL + 'shape = "sphere"',
        's:4: object "ball": shape = "sphere": a table is needed, such as { kind = "sphere", radius = 0.1 }',
    ),
    "unknown key of a shape": (
        BALL + 'shape = { kind = "sphere", radius = 1, raduis = 2 }',
        's:4: object "ball": shape.raduis: unknown key. Did you mean "radius"? Keys here: kind, radius',
    ),
    "shape of no pack": (
        BALL + 'shape = { kind = "ocean:wave" }',
        's:4: shape "ocean:wave" comes from pack "ocean", which is not installed',
    ),
    "pack's shape": (
        BALL + 'shape = { kind = "toy:ring", radius = -1 }',
        "s:4: Ring.radius = -1: a length above 0 is needed",
    ),
    "pack's shape, wrong key": (BALL + 'shape = { kind = "toy:ring", size = 1 }', "s:4: TypeError: "),
    "box of zero size": (
        BALL + 'shape = { kind = "box", size = [1, 0, 1] }',
        "s:4: Box.size = 0.0: a finite length above 0 m is needed",
    ),
    "plane without direction": (
        BALL + 'shape = { kind = "plane", normal = [0, 0, 0] }\nfixed = true',
        "s:4: Plane.normal = (0.0, 0.0, 0.0): three finite numbers, not all 0, are needed",
    ),
    "moving plane": (
        BALL + 'shape = { kind = "plane" }',
        "object 'ball': a plane has no end, so it cannot move: say fixed=True",
    ),
    "fixed and moving": (
        BALL + "velocity = [1, 0, 0]\nfixed = true",
        "object 'ball': fixed=True, yet it has a velocity; what moves is not fixed",
    ),
    "mass and density": (
        BALL + 'shape = { kind = "sphere", radius = 1 }\nmass = 1\ndensity = 2',
        "s:5: object 'ball': mass = 1.0 and density = 2.0: give one of them",
    ),
    "density of a point": (
        BALL + "density = 2",
        "s:4: object 'ball': density = 2.0 needs a shape with a volume; give mass",
    ),
    "inertia of no body": (
        BALL + "inertia = [1, 2, 30]",
        "s:4: object 'ball': inertia = (1.0, 2.0, 30.0): no body has these",
    ),
    "zero quaternion": (
        BALL + "orientation = [0, 0, 0, 0]",
        "s:4: object 'ball': orientation = (0.0, 0.0, 0.0, 0.0): a finite quaternion other than 0 is needed",
    ),
    "short quaternion": (
        BALL + "orientation = [1, 0, 0]",
        's:4: object "ball": orientation = [1, 0, 0]: four numbers (w, x, y, z) are needed, such as [0.0, 0.0, 0.0, 0.0]',
    ),
    "two numbers": (
        BALL + "velocity = [1, 0]",
        's:4: object "ball": velocity = [1, 0]: three numbers in m/s are needed, such as [0.0, 0.0, 0.0]',
    ),
    "a text for a number": (
        BALL + 'mass = "heavy"',
        's:4: object "ball": mass = "heavy": a number with a unit, such as "1 kg", is needed',
    ),
    "wrong unit": (
        BALL + 'mass = "3 m"',
        's:4: object "ball": mass = "3 m": unit m is length, needs kg. Did you mean 3 kg?',
    ),
    "a date": (
        BALL + "mass = 2020-01-01",
        's:4: object "ball": mass = datetime.date(2020, 1, 1): a number in kg is needed',
    ),
    "a switch for a number": (BALL + "mass = true", 's:4: object "ball": mass = true: a number in kg is needed'),
    "a number for a switch": (BALL + "fixed = 1", 's:4: object "ball": fixed = 1: true or false is needed'),
    "unknown key": (
        BALL + "postion = [1, 2, 3]",
        f's:4: object "ball": postion: unknown key. Did you mean "position"? {KEYS}',
    ),
    "unknown section": (
        HEAD + "[[object]]\n",
        's:2: object: unknown key. Did you mean "objects"? Keys here: xpheve, up, seed, compile, stepper, periodic, force_ids, run, containers',
    ),
    "object is a table": (
        HEAD + "[objects]\nmass = 1",
        "s:2: objects = {'mass': 1}: a list of tables is needed: [[objects]]",
    ),
    "object is a number": (HEAD + "objects = [3]", "s:2: object 1 = 3: a table is needed"),
    "name is a number": (HEAD + "[[objects]]\nname = 3", "s:3: object 1: name = 3: a text is needed"),
    "name too long": (
        HEAD + f'[[objects]]\nname = "{"n" * 201}"',
        "names have up to 200 characters, this has 201",
    ),
    "name like a place": (
        HEAD + '[[objects]]\nname = "#1"',
        's:3: object "#1": name = "#1": a name cannot begin with "#"',
    ),
    "two of a name": (
        BALL + '[[objects]]\nname = "ball"',
        's:5: object "ball": name = "ball": line 3 has this name already; names are unique, choose another',
    ),
    "up": (HEAD + 'up = "w"', "s:2: up = \"w\": choose one of 'x', 'y', 'z'"),
    "seed": (HEAD + "seed = -1", "s:2: seed = -1: a whole number from 0 up, of at most 63 bits, is needed"),
    "run": (HEAD + "run = 3", "s:2: run = 3: a table is needed"),
    "run key": (
        HEAD + "[run]\nutnil = 3",
        's:3: run.utnil: unknown key. Did you mean "until"? Keys here: until, dt, every, rtol, atol, record',
    ),
    "negative dt": (HEAD + "[run]\ndt = -1", "s:3: run.dt = -1: a number above 0 s is needed"),
    "until in the past": (HEAD + "[run]\nuntil = -1", "s:3: run.until = -1: a number from 0 s up is needed"),
    "record no text": (HEAD + "[run]\nrecord = 3", "s:3: run.record = 3: a text is needed"),
    "no version": ("[[objects]]", "s:1: the version of the format is missing: begin the file with xpheve = 1"),
    "later version": (
        "xpheve = 2",
        "s:1: xpheve = 2: this xPheve reads version 1 of the format; for another one, upgrade it",
    ),
    "version no number": (
        'xpheve = "1"',
        's:1: xpheve = "1": the version of the format is a whole number, at present 1',
    ),
    "no toml": (HEAD + "[[objects]\n", "s:2: this is no TOML: "),
    "torn": (HEAD + 'name = "ba', "s:2: this is no TOML: "),
    "duplicate key": (BALL + "mass = 1\nmass = 2", "s:5: this is no TOML: Cannot overwrite a value"),
    "control character": (HEAD + "a = '\0'", "s:2: this is no TOML: "),
    "nested too deeply to parse": (
        HEAD + "a = " + "[" * 100_000,
        "s: tables and lists are nested more than 72 deep; no scene needs that",
    ),
    "dots": (
        HEAD + "a" + ".a" * 50_000 + " = 1",
        "s: tables and lists are nested more than 72 deep; no scene needs that",
    ),
    "nested": (
        HEAD + "a = " + "[" * 80 + "]" * 80,
        "s: tables and lists are nested more than 72 deep; no scene needs that",
    ),
    # Laws
    "unknown law": (
        HEAD + '[[laws]]\nid = "toy:wnd"',
        's:3: law "toy:wnd" is not offered by pack "toy". Did you mean "toy:wind"?',
    ),
    "law of no pack": (
        HEAD + '[[laws]]\nid = "ocean:wave"',
        's:3: law "ocean:wave" comes from pack "ocean", which is not installed',
    ),
    "law without id": (HEAD + '[[laws]]\nname = "a"', 's:2: law "a": the key id is missing'),
    "law id no text": (HEAD + "[[laws]]\nid = 3", "s:3: law 1: id = 3: a text is needed"),
    "wrong unit of a parameter": (
        HEAD + '[[laws]]\nid = "toy:pull"\nk = "3 N"',
        's:4: toy:pull.k = "3 N": unit N is kg*m/s^2 (force), needs N/m. Did you mean 3 N/m?',
    ),
    "parameter out of bounds": (HEAD + '[[laws]]\nid = "toy:pull"\nk = -1', "s:4: toy:pull.k = -1.0 N/m: must be >= 0"),
    "parameter nan": (
        HEAD + '[[laws]]\nid = "toy:pull"\nk = nan',
        "s:4: toy:pull.k = nan: a finite number in N/m is needed",
    ),
    "parameter beyond floats": (HEAD + '[[laws]]\nid = "toy:pull"\nk = 1' + "0" * 400, "s:4: "),
    "parameter a table": (
        HEAD + '[[laws]]\nid = "toy:pull"\nk = { a = 1 }',
        "s:4: toy:pull.k = {'a': 1}: a number in N/m is needed",
    ),
    "parameter a choice": (
        HEAD + '[[laws]]\nid = "toy:wind"\nmode = "sott"',
        "s:4: toy:wind.mode = 'sott': choose one of soft, hard. Did you mean \"soft\"?",
    ),
    "unknown parameter": (
        HEAD + '[[laws]]\nid = "toy:wind"\nstrenght = 1',
        's:4: law "toy:wind": unknown parameter strenght. Did you mean "strength"? '
        "It has: push, strength, limit, mode, gusty",
    ),
    "unknown key of a law": (
        HEAD + '[[laws]]\nid = "toy:pull"\nbetwen = 1',
        's:4: law "toy:pull": unknown parameter betwen. Did you mean "between"? It has: k',
    ),
    "enabled": (
        HEAD + '[[laws]]\nid = "toy:pull"\nenabled = 1',
        's:4: law "toy:pull": enabled = 1: true or false is needed',
    ),
    "constructor fails": (HEAD + '[[laws]]\nid = "toy:clumsy"', "s:2: ZeroDivisionError: oh no"),
    "two laws of a name": (
        HEAD + '[[laws]]\nid = "toy:pull"\nname = "a"\n[[laws]]\nid = "toy:wind"\nname = "a"',
        's:7: law "a": name = "a": line 4 has this name already; names are unique, choose another',
    ),
    "law called by nobody's name": (
        HEAD + '[[laws]]\nid = "toy:wind"\nname = "gale"\n[[objects]]\nlaws = ["gael"]',
        's:6: object 1: laws[0]: no law of this file is called "gael". Did you mean "gale"? At hand: gale, toy:wind',
    ),
    "which of two laws": (
        HEAD + '[[laws]]\nid = "toy:wind"\n[[laws]]\nid = "toy:wind"\n[[objects]]\nlaws = ["toy:wind"]',
        's:7: object 1: laws[0]: several laws here are "toy:wind": give them names, or count: "toy:wind#1", '
        '"toy:wind#2", ...',
    ),
    "laws no list": (
        BALL + 'laws = "toy:wind"',
        's:4: object "ball": laws = "toy:wind": a list of names is needed: ["toy:wind"]',
    ),
    "laws of numbers": (BALL + "laws = [1]", 's:4: object "ball": laws = [1]: a list of names is needed'),
    "between nobody": (
        BALL + '[[laws]]\nid = "toy:pull"\nbetween = [["ball"], ["bal"]]',
        's:6: law "toy:pull": between: no object of this file is called "bal". Did you mean "ball"? At hand: ball',
    ),
    "between one": (
        BALL + '[[laws]]\nid = "toy:pull"\nbetween = [["ball"]]',
        "s:6: law \"toy:pull\": between = [['ball']]: two lists of object names are needed, such as "
        '[["sun"], ["earth", "mars"]]',
    ),
    "between for single objects": (
        BALL + '[[laws]]\nid = "toy:wind"\nbetween = ["ball", "ball"]',
        's:6: law "toy:wind": between: toy:wind acts on single objects, so it takes no between; name it in their laws',
    ),
    # Conditions and containers
    "unknown condition": (
        HEAD + '[[laws]]\nid = "toy:tick"\ncondition = { kind = "Elapsd" }',
        's:4: law "toy:tick": condition.kind = "Elapsd": no condition is called so. Did you mean "Elapsed"? '
        "Conditions: Started,",
    ),
    "condition without seconds": (
        HEAD + '[[laws]]\nid = "toy:tick"\ncondition = { kind = "Elapsed" }',
        's:4: law "toy:tick": condition: the key seconds is missing',
    ),
    "unknown key of a condition": (
        HEAD + '[[laws]]\nid = "toy:tick"\ncondition = { kind = "Elapsed", second = 1 }',
        's:4: law "toy:tick": condition.second: unknown key. Did you mean "seconds"? Keys here: kind, once, seconds, every',
    ),
    "condition of no time": (
        HEAD + '[[laws]]\nid = "toy:tick"\ncondition = { kind = "Elapsed", seconds = 0 }',
        "s:4: Elapsed(seconds=0.0): a finite time above 0 s is needed",
    ),
    "condition in metres": (
        HEAD + '[[laws]]\nid = "toy:tick"\ncondition = { kind = "Elapsed", seconds = "1 m" }',
        's:4: law "toy:tick": condition.seconds = "1 m": unit m is length, needs s. Did you mean 1 s?',
    ),
    "every is a number": (
        HEAD + '[[laws]]\nid = "toy:tick"\ncondition = { kind = "Elapsed", seconds = 1, every = 1 }',
        's:4: law "toy:tick": condition.every = 1: true or false is needed',
    ),
    "steps": (
        HEAD + '[[laws]]\nid = "toy:tick"\ncondition = { kind = "Steps", n = 1.5 }',
        's:4: law "toy:tick": condition.n = 1.5: a whole number is needed',
    ),
    "post": (
        HEAD + '[[laws]]\nid = "toy:tick"\ncondition = { kind = "Posted", id = [1] }',
        's:4: law "toy:tick": condition.id = [1]: a whole number or a text is needed',
    ),
    "what changed": (
        HEAD + '[[laws]]\nid = "toy:tick"\ncondition = { kind = "Changed", what = 1 }',
        's:4: law "toy:tick": condition.what = 1: a text is needed',
    ),
    "law without a when": (HEAD + '[[laws]]\nid = "toy:idle"', "s:2: <toy:idle> does not say when"),
    "unknown container": (
        HEAD + '[[containers]]\nname = "clock"\ncondition = { kind = "Started" }\n'
        '[[laws]]\nid = "toy:idle"\ncontainer = "clok"',
        's:7: law "toy:idle": container: no container of this file is called "clok". Did you mean "clock"? At hand: clock',
    ),
    "container that the pack has not": (
        HEAD + '[[laws]]\nid = "toy:idle"\ncontainer = "toy:at_strat"',
        's:4: container "toy:at_strat" is not offered by pack "toy". Did you mean "toy:at_start"?',
    ),
    "container refuses": (
        HEAD + '[[laws]]\nid = "toy:idle"\ncontainer = "toy:gears"',
        "toy:gears accepts PhysicalLaw of role 'clock'; toy:idle is",
    ),
    "container without condition": (
        HEAD + '[[containers]]\nname = "clock"',
        "has no condition: LawContainer(condition), or override detect",
    ),
    "two conditions": (
        HEAD + '[[containers]]\nname = "c"\ncondition = { kind = "Started" }\n'
        '[[laws]]\nid = "toy:idle"\ncontainer = "c"\ncondition = { kind = "Started" }',
        's:8: law "toy:idle": condition: the container "c" has a condition of its own; take one away',
    ),
    # Columns and forces
    "column no number": (
        BALL + "columns = { charge = [1] }",
        "s:4: object \"ball\": columns = {'charge': [1]}: column charge needs a number",
    ),
    "column of nobody in units": (
        BALL + 'columns = { glow = "1 C" }',
        's:4: object "ball": columns.glow = "1 C": no law of this object declares the column, so a unit says nothing; '
        "give a number",
    ),
    "column in metres": (
        BALL + 'laws = ["toy:charged"]\ncolumns = { charge = "1 m" }\n[[laws]]\nid = "toy:charged"',
        's:5: object "ball": columns.charge = "1 m": unit m is length, needs C',
    ),
    "column out of bounds": (
        BALL + 'laws = ["toy:charged"]\ncolumns = { charge = -2 }\n[[laws]]\nid = "toy:charged"',
        's:5: object "ball".charge = -2.0 C: must be >= -1.0',
    ),
    "column nan": (
        BALL + "columns = { charge = nan }",
        's:4: object "ball": columns.charge = nan: a finite number is needed',
    ),
    "column is a key": (
        BALL + "columns = { mass = 1 }",
        's:4: object "ball": columns.mass: mass is no column: write it into the object\'s own table',
    ),
    "endless duration": (
        BALL + "forces = [{ vector = [1, 0, 0], duration = inf }]",
        's:4: object "ball": forces[0].duration = inf: a force that never ends has no duration: leave the key out',
    ),
    "negative duration": (
        BALL + "forces = [{ vector = [1, 0, 0], duration = -1 }]",
        's:4: object "ball": forces[0].duration = -1: a number from 0 s up is needed',
    ),
    "force id": (
        BALL + "forces = [{ id = 1.5 }]",
        's:4: object "ball": forces[0].id = 1.5: a whole number or a text is needed',
    ),
    "large force id": (BALL + f"forces = [{{ id = {1 << 63} }}]", "a whole number of up to 63 bits is needed"),
    "key of a force": (
        BALL + "forces = [{ vektor = [1, 0, 0] }]",
        's:4: object "ball": forces[0].vektor: unknown key. Did you mean "vector"? '
        "Keys here: vector, torque, duration, id",
    ),
    "torque on a point": (
        BALL + "forces = [{ torque = [1, 0, 0] }]",
        "has no inertia, so no torque can turn it",
    ),
}


@pytest.mark.parametrize("text, error", BAD.values(), ids=BAD)
def test_what_is_wrong_is_said_with_place_value_and_way_out(text: str, error: str, registry: Registry) -> None:
    with pytest.raises(SceneError) as told:
        loads(text, name="s", registry=registry)
    assert error in str(told.value)


def test_the_first_problem_is_told_and_the_others_counted(registry: Registry) -> None:
    text = HEAD + '[[objects]]\nmass = 1\n[[objects]]\nmass = -1\nname = "b"\n[[objects]]\nmass = -2\nfixed = 3'
    with pytest.raises(SceneError, match=r'^s:5: object "b": mass = -1: .* \(and 2 more problems\)$'):
        loads(text, name="s", registry=registry)


@pytest.mark.parametrize(
    "text, error",
    [
        ('{"xpheve": 1,\n "objects": [{"mass": NaN}]}', "s:2: NaN: finite numbers are needed"),
        ('{"xpheve": 1,\n "objects": [{"mass": -Infinity}]}', "s:2: -Infinity: finite numbers are needed"),
        (
            '{"xpheve": 1,\n\n "objects": [{"mass": 1e999}]}',
            "s:3: object 1: mass = inf: a finite number in kg is needed",
        ),
        ('{"xpheve": 1,\n "seed": 2,\n "seed": 3}', 's:3: key "seed" stands twice in one table; leave one of them'),
        ('{"xpheve": 1,\n "objects": [\n', "s:3: this is no JSON: Expecting value (column 1)"),
        ("[1]", 's:1: a scene is a table, {"xpheve": 1, ...}, not [1]'),
        ("[" * 100_000, "s: tables and lists are nested more than 72 deep; no scene needs that"),
        ('{"xpheve": ' + "1" * 5000 + "}", "s: this is no JSON: Exceeds the limit (4300 digits)"),
        ("", "s:1: this is no JSON: Expecting value (column 1)"),
        ("{}", 's:1: the version of the format is missing: begin the file with "xpheve": 1'),
        (
            '{"xpheve": 1,\n "objects": [\n  {"name": "\\ud800"}]}',
            's:3: object "\\ud800": name = "\\ud800": half of a surrogate pair is no character',
        ),
        (
            '{"xpheve": 1,\n "objects": [\n  {"position": [0, 0, 0],\n   "mas": 1}]}',
            's:4: object 1: mas: unknown key. Did you mean "mass"?',
        ),
        ('{"xpheve": 1,\n "laws": [\n  {"id": "toy:pull",\n   "k": null}]}', "s:4: toy:pull.k: a value is needed"),
        ('{"xpheve": 1, "objects": null}', "s:1: objects = null: a list of tables is needed: [[objects]]"),
    ],
)
def test_json_is_told_of_the_same_way(text: str, error: str, registry: Registry) -> None:
    with pytest.raises(SceneError) as told:
        loads(text, "json", name="s", registry=registry)
    assert error in str(told.value)


def test_a_form_is_toml_or_json() -> None:
    with pytest.raises(SceneError, match="form = 'yaml': choose 'toml' or 'json'"):
        loads("", "yaml")


def test_files_that_are_no_text_are_told_of(tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_bytes(b"xpheve = 1\na = \xff\xfe\x00")
    with pytest.raises(SceneError, match=r"s\.toml:2: byte 0xff is no UTF-8 text; scenes are TOML or JSON in UTF-8"):
        load(path)
    with pytest.raises(SceneError, match=r"missing\.toml: cannot be read: No such file or directory"):
        load(tmp_path / "missing.toml")
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(SceneError, match=r"cannot be read: Is a directory"):
        load(tmp_path / "folder.toml")
    with pytest.raises(SceneError, match=r"s\.yaml: scene files end in \.toml or \.json, not '\.yaml'"):
        load(tmp_path / "s.yaml")
    with pytest.raises(SceneError, match=r"scene: scene files end in \.toml or \.json, not in nothing"):
        load(tmp_path / "scene")
    with pytest.raises(SceneError, match="cannot be read"):
        load("\0.toml")


def test_a_byte_order_mark_does_not_matter(tmp_path: Path, registry: Registry) -> None:
    path = tmp_path / "s.toml"
    path.write_bytes(b"\xef\xbb\xbfxpheve = 1\r\n[[objects]]\r\nmass = 2\r\n")
    assert load(path, registry=registry).objects[0].mass == 2.0


def test_sizes_are_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "s.toml"
    path.write_text(HEAD + "[[objects]]\n" * 11)
    monkeypatch.setattr(model, "MOST_OBJECTS", 10)
    with pytest.raises(SceneError, match=r"s\.toml:2: objects: 11 objects are more than the 10 that are read"):
        load(path)
    monkeypatch.setattr(source, "LARGEST", 20)
    with pytest.raises(SceneError, match="larger than 0 MiB, the most that is read"):
        load(path)
    with pytest.raises(SceneError, match="has more than 0 million characters"):
        loads("x" * 21)


def test_a_column_that_nobody_reads_but_seems_misspelt_is_warned_of(registry: Registry) -> None:
    text = BALL + 'laws = ["toy:charged"]\ncolumns = { chrage = 1, other = 2 }\n[[laws]]\nid = "toy:charged"'
    with pytest.warns(XpheveWarning, match=r's:5: object "ball": columns\.chrage: no law .* Did you mean "charge"\?'):
        engine = loads(text, name="s", registry=registry)
    assert engine.object("ball").columns == {"chrage": 1.0, "other": 2.0}


def test_laws_that_exclude_each_other_are_told_with_the_line_of_the_object(registry: Registry) -> None:
    text = (
        HEAD + '[[laws]]\nid = "collision:elastic"\nname = "a"\n[[laws]]\nid = "collision:elastic"\nname = "b"\n'
        '[[objects]]\nname = "ball"\nlaws = ["a", "b"]'
    )
    with pytest.raises(SceneError, match=r"^s:10: .* both claim contact-response of"):
        loads(text, name="s", registry=registry)


def test_lines_are_found_in_any_layout_of_toml() -> None:
    text = '''# a comment with [brackets] and "quotes"
xpheve = 1
text = """
[[objects]] in a text # no comment
"""
lit = \'\'\'
a = 1\'\'\'
"quoted key" = { "in ne" = [1, [
  2, # a comment ]
  "x]y" ] ], b = {} }
a.b . c = 1
[t.u]
v = 'x'
[[objects]]
mass = [
  1,
  2]
[objects.shape]
kind = 3
[[objects]]
[[objects.forces]]
id = 1
[[objects.forces]]
id = 2
'''
    lines = source.Lines(text, "toml").found
    wanted: dict[source.Path_, int] = {
        ("xpheve",): 2,
        ("text",): 3,
        ("lit",): 6,
        ("quoted key",): 8,
        ("quoted key", "in ne", 1, 0): 9,
        ("quoted key", "b"): 10,
        ("a", "b", "c"): 11,
        ("t", "u", "v"): 13,
        ("objects", 0): 14,
        ("objects", 0, "mass", 1): 17,
        ("objects", 0, "shape", "kind"): 19,
        ("objects", 1, "forces", 1, "id"): 24,
    }
    assert {path: lines.get(path) for path in wanted} == wanted


def test_lines_are_found_in_json() -> None:
    data = {"a": {"b": [1, {"c": "x,}]"}]}, "d\ne": None}
    lines = source.Lines(json.dumps(data, indent=1), "json").found
    assert lines["a", "b", 1, "c"] == 6
    assert lines[("d\ne",)] == 10
