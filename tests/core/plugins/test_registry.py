"""The registry: ids to classes, listings without imports, switches, duplicates, and the errors a user meets."""

from __future__ import annotations

from typing import Any

import pytest

from xpheve.errors import DuplicateLawError, LawDefinitionError, PackError, UnknownLawError
from xpheve.laws import FieldLaw, LawContainer, Param
from xpheve.laws.conditions import Elapsed
from xpheve.plugins import Registry

AERO = {
    "schema": 1, "pack": "aero", "api": ">=1,<2",
    "laws": [
        {"id": "aero:quadratic_drag", "role": "drag", "kind": "field", "doc": "F = -c |v| v.",
         "params": [{"name": "c", "kind": "number", "unit": "kg/m", "default": 0.1, "gt": 0}]},
        {"id": "aero:wind", "role": "wind", "kind": "field"},
    ],
    "containers": [{"id": "aero:tunnel", "class": "xpheve_aero:Tunnel", "doc": "A tunnel."}],
}  # fmt: skip
LINEAR = {
    "schema": 1, "pack": "slow", "api": "1",
    "laws": [{"id": "slow:linear_drag", "role": "drag", "kind": "field"}],
}  # fmt: skip


AERO_SOURCE = """
    from xpheve.laws import FieldLaw, Param
    __all__ = ["QuadraticDrag", "Wind"]
    class QuadraticDrag(FieldLaw):
        "F = -c |v| v."
        id, role = "aero:quadratic_drag", "drag"
        c = Param(0.1, unit="kg/m", gt=0)
        def force(self, body):
            return -self.c * body.velocity
    class Wind(FieldLaw):
        "Wind."
        id, role = "aero:wind", "wind"
        def force(self, body):
            return (1.0, 0.0, 0.0)
"""


class Push(FieldLaw):
    """A push."""

    id = "toys:push"
    role = "push"
    strength = Param(1.0, unit="N")

    def force(self, body: Any) -> Any:
        return (self.strength, 0.0, 0.0)


class Timer(LawContainer):
    """Each second."""

    id = "toys:timer"
    condition = Elapsed(1.0, every=True)


def test_only_the_pack_that_is_named_is_imported(site: Any) -> None:
    site.pack("aero")
    site.pack("toys")
    out = site.run(
        """
        registry.packs()
        none = [name for name in sys.modules if name.startswith("xpheve_")]
        law = registry.law("aero:wind")
        out = [none, [name for name in sys.modules if name.startswith("xpheve_")], law(c="3 N").c,
               registry.law("aero:wind") is law]
        """
    )
    assert out == [[], ["xpheve_aero"], 3.0, True]


def test_listings_are_read_from_manifests_without_importing(site: Any) -> None:
    site.pack("aero", "1 / 0", manifest=AERO, version="1.2")
    site.pack("slow", "1 / 0", manifest=LINEAR)
    out = site.run(
        """
        laws = registry.laws()
        out = [[(info.id, info.role, info.doc, info.loaded) for info in laws],
               [info.id for info in registry.laws(role="drag")],
               laws[0].spec.params[0].gt, laws[0].distribution, laws[0].version, registry.broken()]
        """
    )
    assert out[0] == [
        ["aero:quadratic_drag", "drag", "F = -c |v| v.", False],
        ["aero:wind", "wind", "", False],
        ["slow:linear_drag", "drag", "", False],
    ]
    assert out[1:] == [["aero:quadratic_drag", "slow:linear_drag"], 0, "xpheve-aero", "1.2", []]


def test_a_pack_without_a_manifest_is_imported_at_the_first_listing_and_that_is_remarked(site: Any) -> None:
    site.pack("aero")
    out = site.run("out = [[(i.id, i.loaded) for i in registry.laws()], registry.remarks()]")
    assert out[0] == [["aero:wind", True]]
    assert "xpheve-aero 1.0: has no manifest, so that listing its laws imported it" in out[1][0]


def test_an_unknown_law_comes_with_its_likeness_and_its_kin(site: Any) -> None:
    site.pack("aero", AERO_SOURCE, manifest=AERO, version="1.2")
    site.pack("slow", "1 / 0", manifest=LINEAR)
    out = site.run(
        """
        ids = ["aero:quadratc_drag", "ocean:buoyancy", "joints:hinge", "areo:wind", "basic:gravity", "wind",
               "aero:xyz", 3]
        out = [error_of(registry.law, id) for id in ids]
        out += [error_of(registry.container, "aero:tunel"), error_of(registry.load, "aeros")]
        """
    )
    assert all(text.startswith("UnknownLawError: ") for text in out)
    near, ocean, joints, areo, basic, wind, nothing, number, container, pack = (text[17:] for text in out)
    assert near == (
        'law "aero:quadratc_drag" is not offered by pack "aero". Did you mean "aero:quadratic_drag" (xpheve-aero 1.2)? '
        'Other laws of role "drag": slow:linear_drag'
    )
    assert ocean == (
        'law "ocean:buoyancy" comes from pack "ocean", which is not installed. Its publisher is not known here; '
        "most packs are called xpheve-NAME: pip install xpheve-ocean"
    )
    assert "pip install xpheve-joints" in joints
    assert areo == (
        'law "areo:wind" comes from pack "areo", which is not installed. Did you mean "aero:wind" (xpheve-aero 1.2)?'
    )
    assert basic.endswith("which is not installed. pip install xpheve-laws-basic")
    assert wind == (
        'law "wind" is not known; an id has the name of its pack in front. Did you mean "aero:wind" (xpheve-aero 1.2)?'
    )
    assert nothing == 'law "aero:xyz" is not offered by pack "aero". It offers: aero:quadratic_drag, aero:wind'
    assert number == 'law 3: an id is a text such as "basic:gravity"'
    assert 'container "aero:tunel" is not offered by pack "aero". Did you mean "aero:tunnel"?' in container
    assert pack == 'pack "aeros" is not installed. Did you mean "aero"?'


def test_a_law_that_only_a_stale_manifest_names_is_said_to_be_so(site: Any) -> None:
    site.pack("aero", manifest=AERO)
    out = site.run("out = [error_of(registry.law, 'aero:quadratic_drag'), registry.remarks()]")
    assert "Its manifest names it, but its module does not offer it: the manifest is stale" in out[0]
    assert "xpheve-aero 1.0: its manifest is stale: " in out[1][0]
    assert "aero:quadratic_drag is no more" in out[1][0]
    assert "aero:wind has changed" in out[1][0]


SWITCHES = [
    ({"XPHEVE_DISABLE": "aero"}, 'is disabled by XPHEVE_DISABLE="aero". To use it: take "aero" out of it'),
    ({"XPHEVE_DISABLE": "toys:push, Xpheve_Aero"}, 'is disabled by XPHEVE_DISABLE="toys:push, Xpheve_Aero"'),
    ({"XPHEVE_DISABLE": "aero:wind"}, 'law "aero:wind" is disabled by XPHEVE_DISABLE="aero:wind"'),
    ({"XPHEVE_PACKS": "toys"}, 'is disabled by XPHEVE_PACKS="toys". To use it: put "aero" into it'),
    ({"XPHEVE_DISABLE_AUTOLOAD": "1"}, "is not loaded under XPHEVE_DISABLE_AUTOLOAD. To use it: set XPHEVE_PACKS=aero"),
    ({"XPHEVE_DISABLE_AUTOLOAD": "1", "XPHEVE_PACKS": "toys"}, 'is disabled by XPHEVE_PACKS="toys"'),
    ({"XPHEVE_DISABLE": "aero", "XPHEVE_PACKS": "aero"}, "is disabled by XPHEVE_DISABLE"),
    ({"XPHEVE_DISABLE_AUTOLOAD": "1", "XPHEVE_PACKS": "aero,toys"}, None),
    ({"XPHEVE_DISABLE_AUTOLOAD": "0", "XPHEVE_DISABLE": "", "XPHEVE_PACKS": " , "}, None),
]


@pytest.fixture(scope="module")
def switched(make_site: Any) -> Any:
    """What one Python says of a law under each set of switches."""
    site = make_site()
    site.pack("aero")
    site.pack("toys")
    return site.run(
        f"""
        out = []
        for environment, _ in {SWITCHES!r}:
            registry = Registry(search_path=[SITE], environment=environment)
            said = error_of(registry.law, "aero:wind")
            out.append([said, [info.id for info in registry.laws()], {{i.name: i.status for i in registry.packs()}}])
        """
    )


@pytest.mark.parametrize("number", range(len(SWITCHES)))
def test_switches_keep_packs_from_being_loaded_and_say_so(switched: Any, number: int) -> None:
    said, laws, status = switched[number]
    expected = SWITCHES[number][1]
    if expected is None:
        assert (said, laws) == ("", ["aero:wind", "toys:wind"])
        return
    assert said.startswith("UnknownLawError: ") and expected in said
    assert "aero:wind" not in laws
    if "aero:wind" not in SWITCHES[number][0].values():
        assert status["aero"] == "disabled"


def test_switches_of_the_environment_and_of_the_constructor_are_joined(site: Any) -> None:
    site.pack("aero")
    site.pack("toys")
    out = site.run(
        """
        one = Registry(search_path=[SITE], disable=["toys"])
        two = Registry(search_path=[SITE], allow=["toys", "aero"], environment={"XPHEVE_PACKS": "toys"})
        out = [[i.id for i in one.laws()], [i.id for i in two.laws()], registry.remarks(),
               "xpheve_aero" in sys.modules, error_of(Registry, disable="toys")]
        """,
        XPHEVE_DISABLE="areo,aero",
    )
    assert out[0] == []
    assert out[1] == ["toys:wind"]
    assert out[2] == ['XPHEVE_DISABLE="areo,aero" names "areo", which is not installed. Did you mean "aero"?']
    assert out[3] is False
    assert out[4] == "PackError: disable='toys': give a list, such as ['toys']"


def test_two_distributions_of_one_pack_are_an_error_only_when_it_is_needed(site: Any) -> None:
    site.pack("aero", version="1.2")
    site.pack("aero", distribution="my-aero", version="0.1", source="1 / 0")
    site.pack("toys")
    out = site.run(
        """
        other = registry.law("toys:wind").__name__
        said = error_of(registry.law, "aero:wind")
        status = [(i.distribution, i.status, i.hint) for i in registry.packs() if i.name == "aero"]
        ways = [Registry(search_path=[SITE], environment={"XPHEVE_PREFER": "Xpheve.Aero"}),
                Registry(search_path=[SITE], prefer=["xpheve-aero"]),
                Registry(search_path=[SITE], disable=["my-aero"])]
        out = [other, said, status, [w.law("aero:wind").__module__ for w in ways],
               [i.status for i in ways[0].packs() if i.name == "aero"]]
        """
    )
    assert out[0] == "Wind"
    assert out[1] == (
        'DuplicateLawError: pack "aero" (for law "aero:wind") is provided by my-aero 0.1 and by xpheve-aero 1.2. '
        "Uninstall one, or set XPHEVE_PREFER=xpheve-aero"
    )
    assert [row[:2] for row in out[2]] == [["my-aero", "duplicate"], ["xpheve-aero", "duplicate"]]
    assert out[3] == ["xpheve_aero"] * 3
    assert out[4] == ["duplicate", "loaded"]


def test_a_pack_installed_while_python_runs_is_seen_after_a_refresh_and_gone_after_another(site: Any) -> None:
    site.pack("toys")
    out = site.run(
        """
        import shutil
        from pathlib import Path
        first = [i.name for i in registry.packs()]
        registry.law("toys:wind")
        new = Path(SITE) / "xpheve_aero"
        shutil.copytree(Path(SITE) / "xpheve_toys", new, ignore=shutil.ignore_patterns("__pycache__"))
        (new / "__init__.py").write_text((new / "__init__.py").read_text().replace("toys", "aero"))
        info = Path(SITE) / "xpheve_aero-1.0.dist-info"
        shutil.copytree(Path(SITE) / "xpheve_toys-1.0.dist-info", info)
        for name in ("METADATA", "entry_points.txt"):
            (info / name).write_text((info / name).read_text().replace("toys", "aero"))
        unseen = error_of(registry.law, "aero:wind")
        registry.refresh()
        seen = registry.law("aero:wind").__name__
        shutil.rmtree(info)
        registry.refresh()
        out = [first, unseen[:16], seen, [i.name for i in registry.packs()], error_of(registry.law, "aero:wind")[:16]]
        """
    )
    assert out == [["toys"], "UnknownLawError:", "Wind", ["toys"], "UnknownLawError:"]


def test_shapes_steppers_and_contact_servers_are_known_by_what_they_offer(site: Any) -> None:
    site.pack(
        "toys",
        """
        __all__ = ["Torus", "Euler", "Server", "helper", "Text"]
        class Torus:
            offers = "shape"
            kind = "torus"
        class Euler:
            offers = "stepper"
            id = "toys:euler"
        class Server:
            offers = "contact_server"
        class Text:
            offers = "something else"
        def helper(): pass
        """,
    )
    out = site.run(
        """
        before = registry.shapes()
        registry.load("toys")
        out = [before, *(sorted(f()) for f in (registry.shapes, registry.steppers, registry.contact_servers)),
               registry.find("shape", "toys:torus").__name__, error_of(registry.find, "shpe", "toys:torus")]
        """
    )
    assert out[:5] == [{}, ["toys:torus"], ["toys:euler"], ["toys:server"], "Torus"]
    assert "choose one of law, container, shape, stepper, contact_server" in out[5]


def test_a_program_registers_classes_of_its_own() -> None:
    registry = Registry(search_path=[])
    registry.register([Push, Timer])
    registry.register([Push, Timer])
    assert registry.law("toys:push") is Push
    assert registry.container("toys:timer") is Timer
    (info,) = registry.laws()
    assert (info.id, info.pack, info.loaded, info.spec.params[0].unit) == ("toys:push", "toys", True, "N")
    assert [(info.name, info.status) for info in registry.packs()] == [("toys", "loaded")]
    with pytest.raises(DuplicateLawError, match=r'a pack "toys" is loaded already'):
        registry.register(Push)
    registry.unregister("toys")
    with pytest.raises(UnknownLawError, match="toys"):
        registry.law("toys:push")
    registry.register(Push)
    assert registry.law("toys:push") is Push


def test_what_is_wrong_with_a_registered_class_raises_at_once_and_changes_nothing() -> None:
    class Bad(FieldLaw):
        """Bad."""

        id = "toys:bad"
        c = Param(1.0, unit="parsnip")

        def force(self, body: Any) -> Any:
            return body.velocity

    registry = Registry(search_path=[])
    with pytest.raises(LawDefinitionError, match=r"Bad: params\.c\.unit = 'parsnip'"):
        registry.register([Push, Bad])
    assert registry.packs() == []
    with pytest.raises(LawDefinitionError, match=r'here "games:push"'):
        registry.register(Push, "games")
    with pytest.raises(PackError, match="is no class of laws"):
        registry.register([Push, 3])
    with pytest.raises(PackError, match="disabled by"):
        Registry(search_path=[], disable=["toys"]).register(Push)


def test_a_module_given_by_a_program_needs_no_all(site: Any) -> None:
    site.pack("aero")
    out = site.run(
        """
        import types
        from xpheve.laws import FieldLaw
        module = types.ModuleType("game")
        class Push(FieldLaw):
            "A push."
            id = "game:push"
            def force(self, body):
                return (1.0, 0.0, 0.0)
        Push.__module__ = "game"
        module.Push = Push
        module.FieldLaw = FieldLaw
        registry.register(module)
        registry.register(module, "game")
        import xpheve_aero
        registry.load_for(xpheve_aero.Wind)
        registry.load_for(FieldLaw)
        out = [[i.id for i in registry.laws()], [(i.name, i.status) for i in registry.packs()]]
        """
    )
    assert out == [["aero:wind", "game:push"], [["aero", "loaded"], ["game", "loaded"]]]


def test_the_trace_says_what_is_loaded_and_how_long_it_took(site: Any) -> None:
    site.pack("aero", version="1.2")
    site.run("registry.law('aero:wind'); out = 0", XPHEVE_TRACE="1")
    assert "xpheve: index of 1 packs, searched, in " in site.stderr
    assert "xpheve: loaded aero (xpheve-aero 1.2) in " in site.stderr
    site.run("registry.law('aero:wind'); out = 0")
    assert site.stderr == ""


def test_many_threads_load_a_pack_once(site: Any) -> None:
    site.pack("aero", "import time\ntime.sleep(0.05)\nfrom xpheve_aero.laws import Wind\n__all__ = ['Wind']")
    (site.path / "xpheve_aero" / "laws.py").write_text(
        "from xpheve.laws import FieldLaw\nclass Wind(FieldLaw):\n    'Wind.'\n    id = 'aero:wind'\n"
        "    def force(self, body):\n        return (0.0, 0.0, 0.0)\n"
    )
    out = site.run(
        """
        from concurrent.futures import ThreadPoolExecutor
        with ThreadPoolExecutor(8) as pool:
            found = set(pool.map(registry.law, ["aero:wind"] * 16))
        out = len(found)
        """
    )
    assert out == 1


def test_the_default_registry_is_one_for_the_process() -> None:
    assert Registry.default() is Registry.default()
