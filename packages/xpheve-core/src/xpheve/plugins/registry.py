"""The registry: which packs there are, and the laws, containers, shapes and steppers in them, imported when named.

Four steps lead from an id such as ``"aero:wind"`` to a class, and each may fail without harm to other packs: the index
says which distribution offers the pack, switches may forbid it, its manifest says whether it fits, its module is
imported and what it offers is checked. A pack that fails is kept apart and named, with the way out, when it is needed.
"""

from __future__ import annotations

import importlib
import os
import re
import sys
import threading
import time
import weakref
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any, ClassVar

from xpheve.errors import (
    BrokenPackError,
    DuplicateLawError,
    IncompatiblePackError,
    PackError,
    UnknownLawError,
    XpheveError,
)
from xpheve.laws import API_VERSION, LawContainer, PhysicalLaw
from xpheve.plugins.index import Index, Offer, locate, normalised, read_index
from xpheve.plugins.suggest import closest
from xpheve.plugins.switches import Switches, read_switches
from xpheve.plugins.trouble import Trouble, guarded, text_of, title, way_out

if TYPE_CHECKING:
    from xpheve.plugins.manifest import Manifest
    from xpheve.plugins.pack import Pack
    from xpheve.plugins.spec import LawSpec

__all__ = ["BrokenPack", "LawInfo", "PackInfo", "Registry"]

# Distributions known to offer a pack; of others only the usual name can be guessed.
PUBLISHERS = {"basic": "xpheve-laws-basic", "collision": "xpheve-laws-collision"}
SHOWN = 8  # ids named in an error; more would hide its point
WRITE = "Run: xpheve manifest --write"


@dataclass(frozen=True, slots=True)
class LawInfo:
    """One law in a listing."""

    id: str
    role: str
    kind: str
    doc: str
    pack: str
    distribution: str
    version: str
    loaded: bool
    spec: LawSpec


@dataclass(frozen=True, slots=True)
class PackInfo:
    """One pack in a listing.

    ``status`` is ``"available"``, ``"loaded"``, ``"disabled"``, ``"broken"``, ``"duplicate"`` or ``"incompatible"``;
    ``reason`` and ``hint`` say why and the way out.
    """

    name: str
    distribution: str
    version: str
    location: str
    status: str
    reason: str = ""
    hint: str = ""
    load_seconds: float = 0.0
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class BrokenPack:
    """A pack that failed: in which phase, with what exception, and what helps."""

    pack: str
    distribution: str
    version: str
    phase: str
    exception: str
    hint: str


@dataclass(frozen=True, slots=True)
class _Failure:
    error: type[XpheveError]
    message: str
    broken: BrokenPack


class Registry:
    """The packs of one search path, under one set of switches.

    Parameters
    ----------
    disable
        Packs, distributions or single ids that are never loaded; joined to those of ``XPHEVE_DISABLE``.
    allow
        If given, only these packs or distributions; ``XPHEVE_PACKS`` narrows it further.
    prefer
        Distributions that win where two offer a pack of one name, before those of ``XPHEVE_PREFER``.
    search_path
        Folders to search instead of ``sys.path``; packs are still imported from ``sys.path``.
    environment
        Instead of ``os.environ``.

    """

    _default: ClassVar[Registry | None] = None
    _default_lock: ClassVar[threading.Lock] = threading.Lock()

    def __init__(
        self,
        *,
        disable: Iterable[str] = (),
        allow: Iterable[str] | None = None,
        prefer: Iterable[str] = (),
        search_path: Sequence[str] | None = None,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        """Read the switches; nothing is searched before somebody asks for something."""
        for name, value in (("disable", disable), ("allow", allow), ("prefer", prefer)):
            if isinstance(value, str):
                raise PackError(f"{name}={value!r}: give a list, such as [{value!r}]")
        self._given = {"disable": tuple(disable), "prefer": tuple(prefer)}
        self._allow = None if allow is None else tuple(allow)
        self._search_path = search_path
        self._environment = environment
        self._lock = threading.RLock()
        self._index: Index | None = None
        self._offers: dict[str, list[Offer]] = {}
        self._packs: dict[str, Pack] = {}
        self._offer_of: dict[str, Offer | None] = {}
        """For each loaded pack the offer it came by; None for one that the program gave."""
        self._failures: dict[str, _Failure] = {}
        self._manifests: dict[Offer, Manifest | None] = {}
        self._remarks: list[str] = []
        self._loading: list[str] = []
        self._manager: Any = None
        """pluggy's manager; None for as long as no loaded pack has hooks."""
        self._engines: list[weakref.ref[Any]] = []
        self._switches = self._read_switches()

    @classmethod
    def default(cls) -> Registry:
        """Return the registry of this process, made at first use."""
        with Registry._default_lock:
            if Registry._default is None:
                Registry._default = Registry()
            return Registry._default

    def refresh(self) -> None:
        """Search again, after something was installed or removed; packs that failed get another try.

        A pack that is loaded stays so, unless its distribution is gone or it is now disabled.
        """
        with self._lock:
            importlib.invalidate_caches()
            self._switches = self._read_switches()
            self._index = None
            self._failures.clear()
            self._manifests.clear()
            self._remarks.clear()
            offers = self._all_offers()
            for name, offer in list(self._offer_of.items()):
                if offer is None:
                    continue
                same = normalised(offer.distribution)
                now = [other for other in offers.get(name, ()) if normalised(other.distribution) == same]
                if not now or self._switches.forbids(now[0]):
                    self.unregister(name)
                    continue
                if now[0].version != offer.version:
                    newer = f"{now[0].version} is installed by now; start Python anew to use it"
                    self._packs[name].remarks.append(newer)
                self._offer_of[name] = now[0]

    def _read_switches(self) -> Switches:
        return read_switches(
            os.environ if self._environment is None else self._environment, allow=self._allow, **self._given
        )

    # What packs offer -------------------------------------------------------------------------------------------------

    def law(self, id: str) -> type[PhysicalLaw]:
        """Return the law class ``id``; its pack is imported if it was not.

        Raises
        ------
        UnknownLawError
            If no installed pack offers it, or it is disabled.
        PackError
            If its pack is broken, made for another law contract, or claimed by two distributions.

        """
        found: type[PhysicalLaw] = self.find("law", id)
        return found

    def container(self, id: str) -> type[LawContainer]:
        """Return the container class ``id``; raises as `law` does."""
        found: type[LawContainer] = self.find("container", id)
        return found

    def find(self, kind: str, id: str) -> Any:
        """Return the class ``id`` of a kind; raises as `law` does.

        Kinds are ``"law"``, ``"container"``, ``"shape"``, ``"stepper"`` and ``"contact_server"``.
        """
        from xpheve.plugins.pack import KINDS

        if kind not in KINDS:
            raise PackError(f"kind={kind!r}: choose one of {', '.join(KINDS)}")
        if not isinstance(id, str):
            raise UnknownLawError(f'{kind} {id!r}: an id is a text such as "basic:gravity"')
        with self._lock:
            name, colon, _ = id.partition(":")
            if not colon:
                raise self._unknown(kind, id)
            if id in self._switches.disabled:
                said = self._switches.disabled[id]
                raise UnknownLawError(f'{kind} "{id}" is disabled by {said}. To use it: take "{id}" out of it')
            pack = self._pack(name, kind, id)
            if id not in pack.offered[kind]:
                raise self._unknown(kind, id)
            return self._resolve(pack, kind, id)

    def shapes(self) -> dict[str, type]:
        """Return the shapes of the loaded packs, by id."""
        return self._loaded("shape")

    def steppers(self) -> dict[str, type]:
        """Return the steppers of the loaded packs, by id."""
        return self._loaded("stepper")

    def contact_servers(self) -> dict[str, type]:
        """Return the contact servers of the loaded packs, by id."""
        return self._loaded("contact_server")

    def _loaded(self, kind: str) -> dict[str, type]:
        with self._lock:
            return {
                id: self._resolve(pack, kind, id)
                for pack in list(self._packs.values())
                for id in list(pack.offered[kind])
                if id not in self._switches.disabled
            }

    def _resolve(self, pack: Pack, kind: str, id: str) -> type:
        """Return the class offered as ``id``, importing it if it was offered as a text."""
        thing = pack.offered[kind][id]
        if not isinstance(thing, str):
            return thing
        try:
            return guarded(pack.resolve, kind, id)
        except Trouble as trouble:
            offer = self._offer_of[pack.name] or _own_offer(pack)
            self.unregister(pack.name)
            raise self._fail(offer, f"importing {thing}", trouble.cause) from trouble.cause

    # Listings ---------------------------------------------------------------------------------------------------------

    def laws(self, role: str = "") -> list[LawInfo]:
        """Return all laws that can be used, by id, or those of one role.

        They are read from manifests; a pack without one is imported. Packs that fail are left out: see `broken`.
        """
        with self._lock:
            names = sorted({*self._all_offers(), *self._packs})
            found = [info for name in names for info in self._laws_of(name, may_import=True)]
        return sorted((info for info in found if not role or info.role == role), key=lambda info: info.id)

    def packs(self) -> list[PackInfo]:
        """Return all packs that are installed or registered, by name, usable or not. Imports none."""
        with self._lock:
            found = [self._info(name, offer) for name, offers in self._all_offers().items() for offer in offers]
            found += [
                PackInfo(name, pack.distribution, pack.version, pack.location, "loaded", remarks=tuple(pack.remarks))
                for name, pack in self._packs.items()
                if self._offer_of[name] is None
            ]
        return sorted(found, key=lambda info: (info.name, info.distribution))

    def broken(self) -> list[BrokenPack]:
        """Return the packs that failed so far, by name. One that nobody named has not been tried: `try_all` does."""
        with self._lock:
            self._all_offers()
            found = [failure.broken for failure in self._failures.values()]
            for info, text in self._index.problems if self._index else ():
                distribution = os.path.basename(info).rpartition(".")[0].partition("-")[0]
                found.append(
                    BrokenPack("", distribution, "", "reading its metadata", text, f"reinstall {distribution}")
                )
        return sorted(found, key=lambda broken: (broken.pack, broken.distribution))

    def try_all(self) -> list[BrokenPack]:
        """Import every pack that the switches allow, and return those that failed, for a check of an installation."""
        with self._lock:
            for name in sorted(self._all_offers()):
                try:
                    pack = self._pack(name)
                    for kind, things in pack.offered.items():
                        for id in list(things):
                            self._resolve(pack, kind, id)
                except XpheveError as wrong:
                    self._trace(str(wrong))
        return self.broken()

    def remarks(self) -> list[str]:
        """Return what is odd but hinders nothing: unmarked hooks, stale manifests, switches that name nothing."""
        with self._lock:
            offers = [offer for offers in self._all_offers().values() for offer in offers]
            known = {*self._packs, *(o.name for o in offers), *(o.distribution for o in offers)}
            own = [
                f"{title(pack.distribution, pack.version) or pack.name}: {remark}"
                for pack in self._packs.values()
                for remark in pack.remarks
            ]
            return [*self._switches.idle(known), *self._remarks, *own]

    def _info(self, name: str, offer: Offer) -> PackInfo:
        def info(status: str, reason: str = "", hint: str = "") -> PackInfo:
            return PackInfo(name, offer.distribution, offer.version, offer.location, status, reason, hint)

        if self._offer_of.get(name) == offer:
            pack = self._packs[name]
            where = (pack.distribution, pack.version, pack.location)
            return PackInfo(name, *where, "loaded", "", "", pack.seconds, tuple(pack.remarks))
        forbidden = self._switches.forbids(offer)
        if forbidden:
            return info("disabled", *forbidden)
        rivals = self._rivals(name)
        if offer not in rivals:
            return info("duplicate", f"{rivals[0].distribution} is preferred", "change XPHEVE_PREFER")
        if len(rivals) > 1:
            others = " and ".join(title(other.distribution, other.version) for other in rivals if other != offer)
            return info("duplicate", f"{others} claims the name too", _prefer(rivals))
        if name not in self._failures:
            try:
                self._manifest(offer)
            except XpheveError as wrong:
                self._trace(str(wrong))
        failure = self._failures.get(name)
        if failure is None:
            return info("available")
        status = "incompatible" if failure.error is IncompatiblePackError else "broken"
        return info(status, failure.broken.exception, failure.broken.hint)

    def _laws_of(self, name: str, *, may_import: bool) -> list[LawInfo]:
        """Return the usable laws of one pack; none if it is in any kind of trouble."""
        try:
            pack = self._packs.get(name)
            if pack is None:
                if name in self._failures:
                    return []
                offer = self._choose(name)
                manifest = self._manifest(offer)
                if manifest is not None:
                    return self._infos(offer, manifest.laws, loaded=False)
                if not may_import:
                    return []
                pack = self._pack(name)
                pack.remarks.append(
                    f"has no manifest, so that listing its laws imported it ({pack.seconds * 1e3:.0f} ms). {WRITE}"
                )
            if may_import:
                for id in list(pack.offered["law"]):
                    self._resolve(pack, "law", id)
        except XpheveError:
            return []  # it is among the broken, or packs() says what is the matter
        return self._infos(self._offer_of[name] or _own_offer(pack), pack.specs.values(), loaded=True)

    def _infos(self, offer: Offer, specs: Iterable[LawSpec], *, loaded: bool) -> list[LawInfo]:
        return [
            LawInfo(s.id, s.role, s.kind, s.doc, offer.name, offer.distribution, offer.version, loaded, s)
            for s in specs
            if s.id not in self._switches.disabled
        ]

    # Loading ----------------------------------------------------------------------------------------------------------

    def load(self, name: str) -> None:
        """Import the pack ``name``, so that what it offers is at hand; raises as `law` does."""
        with self._lock:
            self._pack(name)

    def load_for(self, thing: type) -> None:
        """Load the installed pack that the class ``thing`` came from, if it came from one; a pack's trouble is kept.

        For classes that a program imported itself: their pack's hooks, steppers and contact servers come with them.
        """
        id = getattr(thing, "id", "")
        name = id.partition(":")[0] if isinstance(id, str) else ""
        if not name or name in self._packs or name in self._failures:
            return
        with self._lock:
            top = thing.__module__.partition(".")[0]
            if any(_top(offer) == top for offer in self._all_offers().get(name, ())):
                try:
                    self._pack(name)
                except XpheveError as wrong:
                    self._trace(str(wrong))

    def register(self, source: Any, name: str = "") -> None:
        """Take up a pack that is not installed: a module or object, as an entry point would name it, or classes.

        It comes before an installed pack of the same name.

        Parameters
        ----------
        source
            A module or object with ``__all__`` or hooks; a module without them offers the classes it defines. Or one
            class, or a list of classes.
        name
            Of the pack, with which its ids begin; if not given, taken from them.

        Raises
        ------
        PackError
            If something about it is wrong; nothing has changed then. What its own code raises comes through.

        """
        from xpheve.plugins.pack import Pack, as_source, collect, guess_name

        given, source = source, as_source(source)
        name = name or guess_name(source)
        with self._lock:
            if name in self._switches.disabled:
                raise PackError(f'pack "{name}" is disabled by {self._switches.disabled[name]}')
            if name in self._packs:
                other = self._packs[name]
                if other.given is given or other.given == given:
                    return
                origin = title(other.distribution, other.version) or repr(other.source)
                raise DuplicateLawError(
                    f'a pack "{name}" is loaded already, from {origin}. Take another name, or call unregister("{name}")'
                )
            pack = Pack(name, location=str(getattr(source, "__file__", None) or ""))
            pack.given = given
            implementations = collect(pack, source)
            failure = self._failures.pop(name, None)
            try:
                self._take_up(pack, None, implementations)
            except BaseException:
                self.unregister(name)
                if failure is not None:
                    self._failures[name] = failure
                raise

    def unregister(self, name: str) -> None:
        """Forget the loaded pack ``name``; if it is installed, it is loaded anew when somebody names it."""
        with self._lock:
            self._packs.pop(name, None)
            self._offer_of.pop(name, None)
            if self._manager is not None and self._manager.has_plugin(name):
                self._manager.unregister(name=name)
                if not self._manager.get_plugins():
                    self._manager = None

    def _pack(self, name: str, kind: str = "pack", id: str = "") -> Pack:
        """Return the pack ``name``, imported if it was not, because ``id`` is wanted of it."""
        if name in self._packs:
            return self._packs[name]
        failure = self._failures.get(name)
        if failure is not None:
            raise failure.error(failure.message)
        if name in self._loading:
            raise PackError(f'pack "{name}" asks the registry for itself while it is being imported')
        return self._import(self._choose(name, kind, id or name))

    def _choose(self, name: str, kind: str = "pack", id: str = "") -> Offer:
        """Return the one offer of the pack ``name`` that may be loaded; raises if there is none, or more than one."""
        offers = self._all_offers().get(name, [])
        if not offers:
            raise self._unknown(kind, id or name)
        rivals = self._rivals(name)
        if not rivals:
            reason, hint = self._switches.forbids(offers[0]) or ("", "")
            lead = f'pack "{name}"' if kind == "pack" else f'{kind} "{id}" comes from pack "{name}"'
            origin = title(offers[0].distribution, offers[0].version)
            raise UnknownLawError(f"{lead} ({origin}), which is {reason}. To use it: {hint}")
        if len(rivals) > 1:
            claimants = " and by ".join(title(offer.distribution, offer.version) for offer in rivals)
            for_what = "" if kind == "pack" else f' (for {kind} "{id}")'
            raise DuplicateLawError(f'pack "{name}"{for_what} is provided by {claimants}. {_prefer(rivals)}')
        return rivals[0]

    def _rivals(self, name: str) -> list[Offer]:
        """Return the offers of the pack ``name`` that may be loaded; one, if a distribution is preferred."""
        rivals = [offer for offer in self._all_offers().get(name, ()) if not self._switches.forbids(offer)]
        for distribution in self._switches.preferred:
            for offer in rivals:
                if normalised(offer.distribution) == distribution:
                    return [offer]
        return rivals

    def _import(self, offer: Offer) -> Pack:
        from xpheve.plugins.manifest import api_allows, api_of
        from xpheve.plugins.pack import Pack, collect, import_object

        manifest = self._manifest(offer)
        before = set(sys.modules)
        started = time.perf_counter()
        phase = f"reading its entry point {offer.name} = {offer.module}"
        self._loading.append(offer.name)
        try:
            guarded(_check_entry_point, offer)
            phase = f"importing {offer.module}"
            source = guarded(import_object, offer.module)
            if guarded(_is_unfinished, source):
                raise PackError(f'{offer.module} is being imported; pack "{offer.name}" can be used when that is done')
            phase = "registering what it offers"
            needed = guarded(api_of, source)
            if not guarded(api_allows, needed):
                raise self._incompatible(offer, needed)
            pack = Pack(offer.name, distribution=offer.distribution, version=offer.version, location=offer.location)
            implementations = guarded(collect, pack, source)
            pack.seconds = time.perf_counter() - started
            if manifest is not None:
                pack.remarks += _stale(pack, manifest)
            guarded(self._take_up, pack, offer, implementations)
        except Trouble as trouble:
            self.unregister(offer.name)
            _forget_modules(offer, before)
            raise self._fail(offer, phase, trouble.cause) from trouble.cause
        finally:
            self._loading.remove(offer.name)
        count = len(pack.offered["law"])
        origin = title(offer.distribution, offer.version)
        self._trace(f"loaded {offer.name} ({origin}) in {pack.seconds * 1e3:.1f} ms: {count} laws")
        return pack

    def _take_up(self, pack: Pack, offer: Offer | None, implementations: Mapping[str, Callable[..., Any]]) -> None:
        self._packs[pack.name] = pack
        self._offer_of[pack.name] = offer
        if not set(implementations) - {"xpheve_register"}:
            return
        if self._manager is None:
            from xpheve.plugins.hooks import new_manager

            self._manager = new_manager()
        self._manager.register(pack.source, pack.name)
        if "xpheve_engine_created" in implementations:
            others = [plugin for name, plugin in self._manager.list_name_plugin() if name != pack.name]
            tell = self._manager.subset_hook_caller("xpheve_engine_created", others)
            for engine in self._living_engines():
                tell(engine=engine)

    def _manifest(self, offer: Offer) -> Manifest | None:
        """Return the manifest of ``offer``, None if it has none. A bad one makes the pack a failure, and raises."""
        if offer in self._manifests:
            return self._manifests[offer]
        from xpheve.plugins.manifest import api_allows, read_manifest

        found: Manifest | None = None
        try:
            path = locate(offer.manifest, self._search_path) if offer.manifest else ""
            if path:
                found = read_manifest(path, offer.name)
        except (OSError, ValueError) as wrong:
            raise self._fail(offer, f"reading its manifest {offer.manifest}", wrong) from wrong
        if offer.manifest and not path:
            origin = title(offer.distribution, offer.version)
            self._remarks.append(f"{origin}: there is no manifest {offer.manifest}. {WRITE}")
        if found is not None and not api_allows(found.api):
            raise self._incompatible(offer, found.api)
        self._manifests[offer] = found
        return found

    # Trouble ----------------------------------------------------------------------------------------------------------

    def _fail(self, offer: Offer, phase: str, wrong: BaseException) -> XpheveError:
        """Return the error for a pack that failed, kept so that it is told again rather than tried again."""
        text, hint = text_of(wrong), way_out(offer, wrong)
        manifest = self._manifests.get(offer)
        count = len(manifest.laws) if manifest is not None else 0
        fate = f"Its {count} law{'s are' if count > 1 else ' is'} unavailable" if count else "It is unavailable"
        message = (
            f"{title(offer.distribution, offer.version) or offer.name} failed while {phase} ({text}). {fate}; "
            f"other packs work. Fix: {hint}. Or run without: XPHEVE_DISABLE={offer.name}"
        )
        return self._keep(BrokenPackError, message, offer, phase, text, hint)

    def _incompatible(self, offer: Offer, needed: str) -> XpheveError:
        from xpheve.plugins.manifest import api_allows

        major = offer.version.partition(".")[0]
        older = f', or pip install "{offer.distribution}<{major}"' if major.isdecimal() and int(major) > 0 else ""
        newer = any(api_allows(needed, version) for version in range(API_VERSION + 1, API_VERSION + 50))
        hint = f"Upgrade xpheve{older}" if newer else f"pip install --upgrade {offer.distribution}"
        text = f"needs law API {needed}; this xpheve offers {API_VERSION}"
        message = (
            f"{title(offer.distribution, offer.version)} {text}. {hint}. Or run without: XPHEVE_DISABLE={offer.name}"
        )
        return self._keep(IncompatiblePackError, message, offer, "comparing law APIs", text, hint)

    def _keep(
        self, error: type[XpheveError], message: str, offer: Offer, phase: str, text: str, hint: str
    ) -> XpheveError:
        broken = BrokenPack(offer.name, offer.distribution, offer.version, phase, text, hint)
        self._failures[offer.name] = _Failure(error, message, broken)
        self._trace(message)
        return error(message)

    def _unknown(self, kind: str, id: str) -> UnknownLawError:
        """Return the error for an id that nobody offers; imports nothing."""
        name, colon, _ = id.partition(":")
        packs = {*self._all_offers(), *self._packs}
        laws = {info.id: info for pack in sorted(packs) for info in self._laws_of(pack, may_import=False)}
        ids = packs if kind == "pack" else set(laws) if kind == "law" else self._ids(kind)
        best = closest(id, ids) if colon or kind == "pack" else _closest_without_pack(id, ids)
        meant = f' Did you mean "{best}"?' if best else ""
        if best in laws and laws[best].distribution:
            meant = f' Did you mean "{best}" ({title(laws[best].distribution, laws[best].version)})?'
        if kind == "pack" or (colon and name not in packs):
            which = f'pack "{name}"' if kind == "pack" else f'{kind} "{id}" comes from pack "{name}", which'
            text = f"{which} is not installed.{meant}{_publisher(name, best)}"
        elif not colon:
            text = f'{kind} "{id}" is not known; an id has the name of its pack in front.{meant}'
        else:
            text = f'{kind} "{id}" is not offered by pack "{name}".{self._if_stale(name, kind, id)}{meant}'
        if best in laws:
            role = laws[best].role
            others = [other for other in sorted(laws) if laws[other].role == role and other != best][:SHOWN]
            text += f' Other laws of role "{role}": {", ".join(others)}' if others else ""
        elif not best and name in self._packs:
            offered = sorted(set(self._packs[name].offered[kind]) - set(self._switches.disabled))
            text += f" It offers: {', '.join(offered[:SHOWN])}" if offered else f" It offers no {kind}s"
        return UnknownLawError(text.rstrip("."))

    def _ids(self, kind: str) -> set[str]:
        found = {id for pack in self._packs.values() for id in pack.offered[kind]}
        for manifest in self._manifests.values():
            found |= set(manifest.classes[kind]) if manifest is not None else set()
        return found - set(self._switches.disabled)

    def _if_stale(self, name: str, kind: str, id: str) -> str:
        offer = self._offer_of.get(name)
        manifest = self._manifests.get(offer) if offer is not None else None
        if manifest is None or id not in manifest.classes[kind]:
            return ""
        return f" Its manifest names it, but its module does not offer it: the manifest is stale. {WRITE}."

    # Hooks ------------------------------------------------------------------------------------------------------------

    @property
    def hooks(self) -> Any:
        """The relay to the hooks of the loaded packs, as pluggy makes it; imports pluggy."""
        with self._lock:
            if self._manager is None:
                from xpheve.plugins.hooks import new_manager

                self._manager = new_manager()
            return self._manager.hook

    def call(self, hook: str, **arguments: Any) -> list[Any]:
        """Call ``hook`` in the loaded packs that implement it, and return what they gave.

        Engines given to ``xpheve_engine_created`` are remembered weakly, for packs that are loaded later.

        Raises
        ------
        BrokenPackError
            If an implementation raised, naming its pack; an `XpheveError` comes through as it is.

        """
        if hook == "xpheve_engine_created":
            self._engines = [ref for ref in self._engines if ref() is not None]
            self._engines.append(weakref.ref(arguments["engine"]))
        if self._manager is None:
            return []
        try:
            found: list[Any] = getattr(self._manager.hook, hook)(**arguments)
        except XpheveError:
            raise
        except Exception as wrong:
            raise self._blame(hook, wrong) from wrong
        return found

    def _blame(self, hook: str, wrong: Exception) -> BrokenPackError:
        """Return the error that names the pack whose code raised ``wrong``."""
        packs = {_module_of(pack).partition(".")[0]: pack for pack in self._packs.values()}
        guilty: Pack | None = None
        trace = wrong.__traceback__
        while trace is not None:
            guilty = packs.get(str(trace.tb_frame.f_globals.get("__name__", "")).partition(".")[0], guilty)
            trace = trace.tb_next
        if guilty is None:
            return BrokenPackError(f"a pack failed in {hook} ({text_of(wrong)})")
        origin = title(guilty.distribution, guilty.version) or f'pack "{guilty.name}"'
        return BrokenPackError(
            f"{origin} failed in {hook} ({text_of(wrong)}). Report it to its authors. "
            f"Or run without: XPHEVE_DISABLE={guilty.name}"
        )

    def _living_engines(self) -> list[Any]:
        return [engine for ref in self._engines if (engine := ref()) is not None]

    # The index --------------------------------------------------------------------------------------------------------

    def _all_offers(self) -> dict[str, list[Offer]]:
        """Return all offers by the name of their pack; the index is read at the first call."""
        if self._index is None:
            self._index = read_index(self._search_path)
            self._offers = {}
            for offer in self._index.offers:
                self._offers.setdefault(offer.name, []).append(offer)
            how = "from the cache" if self._index.warm else "searched"
            self._trace(f"index of {len(self._index.offers)} packs, {how}, in {self._index.seconds * 1e3:.1f} ms")
        return self._offers

    def _trace(self, text: str) -> None:
        if self._switches.tracing:
            print(f"xpheve: {text}", file=sys.stderr)


def _check_entry_point(offer: Offer) -> None:
    if not re.fullmatch(r"[a-z0-9_-]+", offer.name):
        raise PackError(f'a pack called "{offer.name}" cannot begin an id; use a-z, 0-9, _ and -')
    module, _, attribute = offer.module.partition(":")
    parts = [*module.split("."), *(attribute.split(".") if attribute else ())]
    if not all(part.isidentifier() for part in parts):
        raise PackError(f'"{offer.module}" is no module; "package.module" is needed')


def _is_unfinished(source: Any) -> bool:
    """Return whether ``source`` is a module in the midst of being imported, by somebody up the stack."""
    return bool(getattr(getattr(source, "__spec__", None), "_initializing", False))


def _stale(pack: Pack, manifest: Manifest) -> list[str]:
    """Return a remark on what the manifest says otherwise than the module."""
    odd: list[str] = []
    for kind, things in pack.offered.items():
        listed = set(manifest.classes[kind])
        odd += [f"{id} is missing" for id in set(things) - listed] + [f"{id} is no more" for id in listed - set(things)]
    aside = {"api": "", "nature": ""}  # the nature is found by tracing, which takes too long here
    listed_specs = {spec.id: {**spec.to_dict(), **aside} for spec in manifest.laws}
    for id, spec in pack.specs.items():
        if id in listed_specs and sys.flags.optimize < 2 and {**spec.to_dict(), **aside} != listed_specs[id]:
            odd.append(f"{id} has changed")
    return [f"its manifest is stale: {', '.join(sorted(odd))}. {WRITE}"] if odd else []


def _forget_modules(offer: Offer, before: set[str]) -> None:
    """Drop what a failed import left in ``sys.modules``, so that another try starts afresh."""
    top = _top(offer)
    for module in set(sys.modules) - before:
        if module == top or module.startswith(top + "."):
            del sys.modules[module]


def _closest_without_pack(local: str, ids: Iterable[str]) -> str:
    """Return the one of ``ids`` whose part behind the colon is ``local``, or nearly so."""
    by_local = {id.partition(":")[2]: id for id in sorted(ids, reverse=True)}
    return by_local.get(local) or by_local.get(closest(local, by_local), "")


def _publisher(name: str, best: str) -> str:
    if name in PUBLISHERS:
        return f" pip install {PUBLISHERS[name]}"
    if best and closest(name, [best.partition(":")[0]]):
        return ""  # a slip of the finger in the name of a pack that is installed
    return f" Its publisher is not known here; most packs are called xpheve-NAME: pip install xpheve-{name}"


def _own_offer(pack: Pack) -> Offer:
    """Return an offer that stands for a pack given by the program."""
    return Offer(pack.name, _module_of(pack), "", pack.distribution, pack.version, pack.location)


def _module_of(pack: Pack) -> str:
    source = pack.source
    return str(vars(source).get("__name__", "") if isinstance(source, ModuleType) else type(source).__module__)


def _top(offer: Offer) -> str:
    return offer.module.partition(":")[0].partition(".")[0]


def _prefer(rivals: Sequence[Offer]) -> str:
    return f"Uninstall one, or set XPHEVE_PREFER={rivals[-1].distribution}"
