"""Hooks: called where a pack implements them, free where none does, and never silently wrong."""

from __future__ import annotations

import gc
import types
from typing import Any

import pytest

from xpheve.errors import BrokenPackError, PackError, XpheveError
from xpheve.laws import FieldLaw
from xpheve.plugins import Registry, hookimpl
from xpheve.plugins.hooks import HookSpecs, implementations, spec_arguments


class Push(FieldLaw):
    """A push."""

    id = "toys:push"

    def force(self, body: Any) -> Any:
        return (1.0, 0.0, 0.0)


class Engine:
    """Stands for an engine; hooks only pass it on."""


def test_a_pack_registers_by_hook_and_texts_are_imported_at_first_use(site: Any) -> None:
    site.pack(
        "aero",
        """
        from xpheve.plugins import hookimpl
        @hookimpl
        def xpheve_register(registry):
            registry.add_law("xpheve_aero.laws:Wind", id="aero:wind")
            registry.add_law("xpheve_aero.gone:Gale", id="aero:gale")
            registry.add_shape("xpheve_aero.laws:Torus", id="aero:torus")
        """,
    )
    (site.path / "xpheve_aero" / "laws.py").write_text(
        "from xpheve.laws import FieldLaw\nclass Wind(FieldLaw):\n    'Wind.'\n    id = 'aero:wind'\n"
        "    def force(self, body):\n        return (0.0, 0.0, 0.0)\n"
        "class Torus:\n    offers = 'shape'\n    kind = 'torus'\n"
    )
    out = site.run(
        """
        registry.load("aero")
        lazy = "xpheve_aero.laws" in sys.modules
        law = registry.law("aero:wind").__name__
        shape = registry.find("shape", "aero:torus").__name__
        gone = error_of(registry.law, "aero:gale")
        out = [lazy, law, shape, gone, registry.broken()[0].pack, error_of(registry.law, "aero:wind") == gone]
        """
    )
    assert out[:3] == [False, "Wind", "Torus"]
    assert "xpheve-aero 1.0 failed while importing xpheve_aero.gone:Gale (ModuleNotFoundError" in out[3]
    assert out[4:] == ["aero", True]


def test_without_hooks_a_call_costs_nothing_and_pluggy_stays_out(site: Any) -> None:
    site.pack("aero")
    out = site.run(
        """
        class Engine: pass
        registry.law("aero:wind")
        engine = Engine()
        gave = [registry.call("xpheve_engine_created", engine=engine), registry.call("xpheve_plan", plan=None)]
        out = [gave, "pluggy" in sys.modules]
        """
    )
    assert out == [[[], []], False]


def test_hooks_are_called_in_the_packs_that_have_them() -> None:
    heard: list[object] = []
    pack: Any = types.ModuleType("toys")
    pack.Push = Push
    pack.__all__ = ["Push"]

    @hookimpl
    def xpheve_plan(plan: Any) -> str:
        heard.append(("plan", plan))
        return "changed"

    @hookimpl(specname="xpheve_report")
    def on_report(report: Any) -> None:
        report.append("a line")

    pack.xpheve_plan, pack.on_report = xpheve_plan, on_report
    registry = Registry(search_path=[])
    registry.register(pack, "toys")
    report: list[str] = []
    assert registry.call("xpheve_plan", plan="the plan") == ["changed"]
    assert heard == [("plan", "the plan")]
    registry.call("xpheve_report", engine=None, report=report)
    assert report == ["a line"]
    assert registry.law("toys:push") is Push
    registry.unregister("toys")
    assert registry.call("xpheve_plan", plan="the plan") == []


def test_a_pack_hears_of_engines_that_were_there_before_it() -> None:
    registry = Registry(search_path=[])
    first, second, lost = Engine(), Engine(), Engine()
    registry.call("xpheve_engine_created", engine=first)
    registry.call("xpheve_engine_created", engine=lost)
    del lost
    gc.collect()

    class Pack:
        __all__ = ()

        def __init__(self) -> None:
            self.heard: list[Engine] = []

        @hookimpl
        def xpheve_engine_created(self, engine: Engine) -> None:
            self.heard.append(engine)

    one, two = Pack(), Pack()
    registry.register(one, "one")
    assert one.heard == [first]
    registry.call("xpheve_engine_created", engine=second)
    registry.register(two, "two")
    assert one.heard == [first, second]
    assert two.heard == [first, second]


def test_a_hook_that_raises_is_the_fault_of_its_pack(site: Any) -> None:
    site.pack(
        "aero",
        """
        from xpheve.errors import ConflictError
        from xpheve.plugins import hookimpl
        __all__ = []
        @hookimpl
        def xpheve_plan(plan):
            if plan: raise ConflictError("a veto")
            1 / 0
        """,
    )
    out = site.run(
        """
        registry.load("aero")
        out = [error_of(registry.call, "xpheve_plan", plan=0), error_of(registry.call, "xpheve_plan", plan=1)]
        """
    )
    assert out[0] == (
        "BrokenPackError: xpheve-aero 1.0 failed in xpheve_plan (ZeroDivisionError: division by zero). "
        "Report it to its authors. Or run without: XPHEVE_DISABLE=aero"
    )
    assert out[1] == "ConflictError: a veto"


def test_functions_that_look_like_hooks_but_are_not_are_remarked(site: Any) -> None:
    site.pack(
        "aero",
        """
        __all__ = []
        def xpheve_plan(plan): pass
        def xpheve_raport(engine, report): pass
        def xpheve_version(): pass
        def plan(): pass
        """,
    )
    out = site.run("registry.load('aero'); out = registry.remarks()")
    assert out == [
        "xpheve-aero 1.0: xpheve_plan lacks @hookimpl and will never be called",
        'xpheve-aero 1.0: xpheve_raport is no known hook and will never be called. Did you mean "xpheve_report"?',
    ]


def test_a_pack_whose_engine_hook_fails_at_loading_is_not_half_loaded() -> None:
    class Pack:
        __all__ = ()

        @hookimpl
        def xpheve_engine_created(self, engine: Engine) -> None:
            raise ValueError("no")

    registry = Registry(search_path=[])
    engine = Engine()
    registry.call("xpheve_engine_created", engine=engine)
    with pytest.raises(ValueError, match="no"):
        registry.register(Pack(), "toys")
    assert registry.packs() == []
    assert registry.call("xpheve_engine_created", engine=engine) == []


def test_implementations_may_leave_arguments_out_but_not_invent_them() -> None:
    module: Any = types.ModuleType("toys")

    @hookimpl
    def xpheve_report() -> None:
        pass

    module.xpheve_report = xpheve_report
    assert list(implementations(module)) == ["xpheve_report"]

    @hookimpl(specname="xpheve_report")
    def misspelt(raport: Any) -> None:
        pass

    module.xpheve_report = misspelt
    with pytest.raises(PackError, match=r"no argument 'raport'; it may take: engine, report\. Did you mean \"report\""):
        implementations(module)


def test_the_hooks_are_those_of_the_page() -> None:
    assert spec_arguments() == {
        "xpheve_register": ("registry",),
        "xpheve_engine_created": ("engine",),
        "xpheve_plan": ("plan",),
        "xpheve_report": ("engine", "report"),
    }
    assert all(getattr(HookSpecs, name).__doc__ for name in spec_arguments())
    assert issubclass(BrokenPackError, XpheveError)
    assert hasattr(Registry(search_path=[]).hooks, "xpheve_plan")
