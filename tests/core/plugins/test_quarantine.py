"""Quarantine: a pack may break in any way; it is named with the way out when needed, and the others go on."""

from __future__ import annotations

from typing import Any

import pytest

OK = """
    from xpheve.laws import FieldLaw, Param
    __all__ = ["{cls}"]
    class {cls}(FieldLaw):
        "A law."
        id = "{id}"
        {body}
        def force(self, body):
            return (0.0, 0.0, 0.0)
"""


def law(id: str, body: str = "pass", cls: str = "Wind") -> str:
    return OK.format(id=id, body=body, cls=cls)


# Each pack: its source, and what the error must say besides its distribution and the way to run without it.
ZOO: dict[str, tuple[str, list[str]]] = {
    "missing": ("import no_such_library.part", ["ModuleNotFoundError", "Fix: pip install no_such_library."]),
    "syntax": ("def broken(:\n    pass", ["SyntaxError", "__init__.py, line 1"]),
    "raises": ("1 / 0", ["importing xpheve_raises", "ZeroDivisionError: division by zero"]),
    "exits": ("raise SystemExit(3)", ["SystemExit: 3"]),
    "base": ("class Odd(BaseException): pass\nraise Odd('odd')", ["Odd: odd"]),
    "mute": ("class E(Exception):\n    def __str__(self): raise ValueError\nraise E", ["E: its text cannot be shown"]),
    "deep": ("def f(): f()\nf()", ["RecursionError"]),
    "lazyexit": ("def __getattr__(name): raise SystemExit(name)", ["registering what it offers", "SystemExit"]),
    "old": ("from xpheve.laws import NoSuchLaw", ["ImportError", "it was made for another xpheve"]),
    "empty": ("", ["neither __all__ nor a hook", "is it really a pack?"]),
    "textall": ("__all__ = 'Wind'", ["__all__ of xpheve_textall is 'Wind': a list of names is needed"]),
    "noname": (law("noname:wind").replace('["Wind"]', '["Wnd"]'), ["names 'Wnd', which is not there", '"Wind"?']),
    "prefix": (law("other:wind"), ['id = "other:wind": ids begin with the name of their pack, here "prefix:wind"']),
    "badid": (law("badid:Wind!"), ["xpheve_badid.Wind: id = 'badid:Wind!'"]),
    "noid": (law(""), ["xpheve_noid.Wind has no id", 'id = "noid:name"']),
    "unit": (law("unit:wind", "c = Param(1.0, unit='furlong')"), ["xpheve_unit.Wind: params.c.unit = 'furlong'",
                                                                  '"furlong" is no unit']),
    "notsi": (law("notsi:wind", "c = Param(1.0, unit='km/h')"), ["is not SI", "Declare m/s"]),
    "bounds": (law("bounds:wind", "c = Param(-1.0, gt=0)"), ["the default does not fit", "must be > 0"]),
    "cross": (law("cross:wind", "c = Param(1.0, gt=3, lt=2)"), ["no value lies between the bounds 3 and 2"]),
    "twice": (law("twice:wind").replace('["Wind"]', '["Wind", "Gale"]')
              + "\n    class Gale(Wind):\n        'A gale.'\n", ['have the id "twice:wind"']),
    "hides": (law("hides:wind", "c = Param(1.0)").replace('["Wind"]', '["Gale"]')
              + "\n    class Gale(Wind):\n        id = 'hides:gale'\n        c = 3.0\n",
              ["c = 3.0 hides the parameter"]),
    "taken": (law("taken:wind", "name = Param(1.0)"), ["params.name.name = 'name'", "call the parameter something"]),
    "before": (law("before:wind", "before = 'basic:gravity'"), ["before = 'basic:gravity'", "valid tuple"]),
    "says": (law("says:wind").replace("def force", "def forec"), ["says nothing: write force(self, body)"]),
    "enforce": (law("enforce:wind").replace("def force(self, body)", "def enforce(self, event)"),
                ["overrides enforce, which is final"]),
    "condition": (law("condition:wind", "condition = 'start'"), ["condition = 'start'"]),
    "column": (law("column:wind", "columns = {'charge': 1.0}"), ["columns = {'charge': 1.0}"]),
    "declare": (law("declare:wind", "c = Param('a', choices=('b',))"), ["default 'a' is none of the choices"]),
    "container": ("""
        from xpheve.laws import LawContainer
        __all__ = ["Box"]
        class Box(LawContainer):
            id = "other:box"
        """, ['id = "other:box": ids begin with']),
    "hookname": ("""
        from xpheve.plugins import hookimpl
        @hookimpl
        def xpheve_registr(registry): pass
        """, ["xpheve_registr is no known hook", 'Did you mean "xpheve_register"?']),
    "hookarg": ("""
        from xpheve.plugins import hookimpl
        @hookimpl
        def xpheve_register(registy): pass
        """, ["xpheve_register has no argument 'registy'", "it may take: registry", 'Did you mean "registry"?']),
    "hookfails": ("""
        from xpheve.plugins import hookimpl
        @hookimpl
        def xpheve_register(registry): registry.add_law("nowhere:Law")
        """, ["ModuleNotFoundError", "pip install nowhere"]),
    "unmarked": ("def xpheve_register(registry): pass", ["xpheve_register lacks @hookimpl and will never be called"]),
    "Capital": (law("Capital:wind"), ['"Capital" cannot begin an id']),
}  # fmt: skip

# Broken manifests: the module itself is sound.
MANIFESTS: dict[str, tuple[Any, list[str]]] = {
    "torn": ('{"schema": 1, "pack": "torn", "la', ["reading its manifest xpheve_torn:xpheve.json", "JSONDecodeError"]),
    "list": ([], ["a list, not a table"]),
    "deepjson": ("[" * 100_000, ["nested too deeply"]),
    "huge": ('{"schema": 1, "pad": "' + "x" * (5 << 20) + '"}', ["larger than"]),
    "newer": ({"schema": 2, "pack": "newer", "api": "1", "laws": []}, ["its schema is 2; this xpheve reads 1"]),
    "wrongname": ({"schema": 1, "pack": "x", "api": "1"}, ["\"pack\" is 'x', but the entry point says 'wrongname'"]),
    "wrongid": ({"schema": 1, "pack": "wrongid", "api": "1", "laws": [{"id": 3}]}, ['"laws" has the id 3']),
    "wronglaw": ({"schema": 1, "pack": "wronglaw", "api": "1", "laws": [{"id": "wronglaw:a", "role": 5, "kind": "x"}]},
                 ["role of a law is 5"]),
    "badapi": ({"schema": 1, "pack": "badapi", "api": "soon", "laws": []}, ["\"api\" is 'soon'"]),
    "future": ({"schema": 1, "pack": "future", "api": ">=3,<4", "laws": []},
               ["IncompatiblePackError: xpheve-future 2.1 needs law API >=3,<4; this xpheve offers 1. Upgrade xpheve, "
                'or pip install "xpheve-future<2"']),
}  # fmt: skip


@pytest.fixture(scope="module")
def zoo(make_site: Any) -> Any:
    """One Python that sees all the broken packs and a sound one; what it says of each."""
    site = make_site()
    for name, (source, _) in ZOO.items():
        site.pack(name, source)
    for name, (manifest, _) in MANIFESTS.items():
        site.pack(name, law(f"{name}:wind"), manifest=manifest, version="2.1" if name == "future" else "1.0")
    site.pack("entry", target="xpheve_entry.no_such_module", version="0.4")
    site.pack("noentry", target="not a module")
    site.pack("sound")
    return site.run(
        """
        before = registry.law("sound:wind").__name__
        names = [info.name for info in registry.packs() if info.name != "sound"]
        errors = {name: error_of(registry.law, name + ":wind") for name in names}
        again = {name: error_of(registry.law, name + ":wind") for name in names}
        out = {
            "before": before,
            "after": registry.law("sound:wind")(c="2 N").c,
            "errors": errors,
            "same_again": again == errors,
            "broken": [vars_of for b in registry.broken() for vars_of in [[b.pack, b.distribution, b.version, b.phase,
                       b.exception, b.hint]]],
            "status": {info.name: info.status for info in registry.packs()},
            "laws": [info.id for info in registry.laws()],
            "left": [name for name in sys.modules if name.startswith("xpheve_") and name != "xpheve_sound"],
        }
        """
    )


@pytest.mark.parametrize("name", [*ZOO, *MANIFESTS])
def test_a_broken_pack_is_named_with_what_is_wrong_and_the_way_out(zoo: Any, name: str) -> None:
    said = zoo["errors"][name]
    for part in (f"xpheve-{name} ", f"XPHEVE_DISABLE={name}", *(ZOO | MANIFESTS)[name][1]):
        assert part in said
    assert len(said) < 1200


def test_entry_points_that_lead_nowhere_are_broken_packs(zoo: Any) -> None:
    assert "xpheve-entry 0.4 failed while importing xpheve_entry.no_such_module" in zoo["errors"]["entry"]
    assert "reinstall xpheve-entry" in zoo["errors"]["entry"]
    assert '"not a module" is no module' in zoo["errors"]["noentry"]


def test_the_sound_pack_among_the_broken_ones_works_before_and_after(zoo: Any) -> None:
    assert zoo["before"] == "Wind"
    assert zoo["after"] == 2.0
    assert zoo["laws"] == ["sound:wind"]
    assert zoo["status"]["sound"] == "loaded"


def test_broken_packs_are_listed_with_phase_exception_and_hint(zoo: Any) -> None:
    listed = {pack: rest for pack, *rest in zoo["broken"]}
    assert set(listed) == {*ZOO, *MANIFESTS, "entry", "noentry"}
    assert all(text and not text.isspace() for rest in listed.values() for text in rest)
    distribution, version, phase, exception, hint = listed["missing"]
    assert (distribution, version) == ("xpheve-missing", "1.0")
    assert phase == "importing xpheve_missing"
    assert exception == "ModuleNotFoundError: No module named 'no_such_library'"
    assert hint == "pip install no_such_library"
    assert zoo["status"]["missing"] == "broken"
    assert zoo["status"]["future"] == "incompatible"


def test_a_broken_pack_is_tried_once_and_leaves_no_modules_behind(zoo: Any) -> None:
    assert zoo["same_again"]
    assert zoo["left"] == []


def test_a_repaired_pack_works_after_a_refresh(site: Any) -> None:
    site.pack("aero", "from xpheve_aero.inner import nothing")
    out = site.run(
        f"""
        from pathlib import Path
        first = error_of(registry.law, "aero:wind")
        home = Path(SITE) / "xpheve_aero"
        (home / "__init__.py").write_text({law("aero:wind")!r}.replace("\\n    ", "\\n"))
        registry.refresh()
        out = [first, registry.law("aero:wind").__name__, registry.broken()]
        """
    )
    assert "No module named 'xpheve_aero.inner'" in out[0]
    assert out[1:] == ["Wind", []]


def test_control_c_while_a_pack_is_imported_is_no_fault_of_the_pack(site: Any) -> None:
    site.pack("slow", "import os\nif 'AGAIN' not in os.environ: raise KeyboardInterrupt\n__all__ = []")
    out = site.run(
        """
        import os
        try:
            registry.load("slow")
        except KeyboardInterrupt:
            first = "interrupted"
        os.environ["AGAIN"] = "1"
        registry.load("slow")
        out = [first, registry.broken(), [info.status for info in registry.packs()]]
        """
    )
    assert out == ["interrupted", [], ["loaded"]]


def test_a_pack_that_asks_for_itself_while_it_is_imported_is_told_so(site: Any) -> None:
    site.pack("snake", "from xpheve.plugins import Registry\nRegistry.default().law('snake:wind')\n__all__ = []")
    out = site.run(
        """
        ring = error_of(Registry.default().law, "snake:wind")
        out = ring
        """
    )
    assert 'pack "snake" asks the registry for itself while it is being imported' in out


def test_a_law_without_a_docstring_works_and_is_remarked(site: Any) -> None:
    site.pack("aero", law("aero:wind").replace('"A law."', ""))
    out = site.run("out = [registry.law('aero:wind').__name__, registry.remarks()]")
    assert out[0] == "Wind"
    assert out[1] == ["xpheve-aero 1.0: aero:wind has no docstring, so that listings cannot say what it does"]


def test_try_all_imports_everything_and_names_what_fails(site: Any) -> None:
    site.pack("aero")
    site.pack("toys", "1 / 0")
    out = site.run("out = [[b.pack for b in registry.try_all()], [p.status for p in registry.packs()]]")
    assert out == [["toys"], ["loaded", "broken"]]
