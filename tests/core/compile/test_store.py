"""The cache of compiled code: whatever is wrong with it, the run goes on with the same bits; what is not the user's is not run."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import stat
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from xpheve.compile import Kernel, compiled, store
from xpheve.compile.loader import machine
from xpheve.errors import CompileWarning

TEXT = "def entry(f, n):\n    x = f[0]\n    x[0] = x[0] / 3.0 + 7.0\n    return 21\n"
OTHER = "def entry(f, n):\n    x = f[0]\n    x[0] = -5.0\n    return 22\n"
Process = Callable[..., subprocess.CompletedProcess[str]]
Forget = Callable[[], None]

posix = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="owners and modes of files are those of POSIX")


def right(kernel: Kernel) -> bool:
    x = np.array([2.0])
    return kernel([x], []) == 21 and x[0] == 2.0 / 3.0 + 7.0


@pytest.fixture
def entry(cache: Path, forget: Forget) -> Path:
    """A good entry of TEXT, in a process that does not remember it."""
    path = Path(compiled(TEXT).path)
    forget()
    return path


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is compiled from here on."""
    from xpheve.compile import machine as module

    made: list[str] = []
    real = module.machine_code
    monkeypatch.setattr(module, "machine_code", lambda text, what: (made.append(what), real(text, what))[1])
    return made


def test_the_folder_is_made_for_the_user_alone(entry: Path, cache: Path) -> None:
    assert entry.parent == cache
    assert [path.name for path in cache.iterdir()] == [entry.name]
    if hasattr(os, "geteuid"):
        assert stat.S_IMODE(cache.stat().st_mode) == 0o700 and stat.S_IMODE(entry.stat().st_mode) == 0o600


# Damage --------------------------------------------------------------------------------------------------------------


def places(data: bytes) -> Iterator[int]:
    """Lengths at which an entry may have been cut: around every border, and in the middle of every part."""
    head = len(store.MAGIC)
    header = int.from_bytes(data[head + 32 : head + 36], "little")
    borders = [0, head, head + 32, head + 36, head + 36 + header, len(data)]
    for low, high in pairwise(borders):
        yield from {low, low + 1, (low + high) // 2, high - 1}


def test_a_torn_entry_is_made_again_wherever_it_was_torn(entry: Path, forget: Forget, counted: list[str]) -> None:
    whole = entry.read_bytes()
    torn = sorted(set(places(whole)) - {len(whole)})
    assert len(torn) > 15
    for count, length in enumerate(torn, 1):
        entry.write_bytes(whole[:length])
        kernel = compiled(TEXT)
        assert kernel.origin == "compiled" and right(kernel), length
        assert len(counted) == count
        forget()
        assert compiled(TEXT).origin == "cache"  # once: the next finds it whole
        forget()


def test_a_bit_that_turned_anywhere_is_seen(entry: Path) -> None:
    whole = entry.read_bytes()
    key = entry.stem
    assert store.read(key) is not None
    for place in range(0, len(whole), 5):
        entry.write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        assert store.read(key) is None, place
    entry.write_bytes(whole + b"\0")
    assert store.read(key) is None


def sealed(header: object, code: bytes) -> bytes:
    """An entry with a hash that is right, whatever is in it."""
    text = json.dumps(header).encode()
    rest = len(text).to_bytes(4, "little") + text + code
    return store.MAGIC + hashlib.sha256(rest).digest() + rest


def code_that_needs(name: str) -> bytes:
    """Object code with an ``entry`` that calls ``name``; without a name, with no ``entry`` at all."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    call = f"declare i32 @{name}()\ndefine i32 @entry() {{ %a = call i32 @{name}()\nret i32 %a }}"
    module = llvm.parse_assembly(call if name else "define i32 @another() { ret i32 1 }")
    return bytes(llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine().emit_object(module))


@pytest.mark.parametrize(
    "what",
    [
        "empty",
        "noise",
        "program",
        "other code",
        "no code",
        "a list",
        "no symbol",
        "unknown names",
        "a folder",
        "a pipe",
    ],
)
def test_what_is_no_entry_of_ours_is_a_miss(entry: Path, forget: Forget, what: str) -> None:
    key = entry.stem
    if what in ("a folder", "a pipe"):
        entry.unlink()
        if what == "a folder":
            entry.mkdir()
        elif hasattr(os, "mkfifo"):
            os.mkfifo(entry)
        if what == "a folder":
            with pytest.warns(CompileWarning, match="cannot be kept"):
                assert right(compiled(TEXT))
            return
    else:
        entry.write_bytes(
            {
                "empty": b"",
                "noise": np.random.default_rng(1).bytes(5000),
                "program": Path(sys.executable).read_bytes()[:100000],
                "other code": sealed({"key": key, "symbol": "entry", "what": ""}, code_that_needs("")),
                "no code": sealed({"key": key, "symbol": "entry", "what": ""}, b"nothing"),
                "a list": sealed([1, 2], b""),
                "no symbol": sealed({"key": key, "what": ""}, b""),
                "unknown names": sealed(
                    {"key": key, "symbol": "entry", "what": ""}, code_that_needs("xpheve_no_such_function")
                ),
            }[what]
        )
    kernel = compiled(TEXT)
    assert kernel.origin == "compiled" and right(kernel)
    forget()
    assert compiled(TEXT).origin == "cache"


def test_the_entry_of_another_text_under_this_name_is_a_miss(entry: Path, forget: Forget) -> None:
    other = Path(compiled(OTHER).path)
    forget()
    shutil.copy(other, entry)
    kernel = compiled(TEXT)
    assert kernel.origin == "compiled" and right(kernel)


def test_a_cache_copied_elsewhere_is_as_good(entry: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(entry.parent.parent, tmp_path / "elsewhere")
    monkeypatch.setenv("XPHEVE_CACHE_DIR", str(tmp_path / "elsewhere"))
    kernel = compiled(TEXT)
    assert kernel.origin == "cache" and right(kernel) and kernel.path.startswith(str(tmp_path / "elsewhere"))


def test_another_processor_numba_or_form_is_another_key(monkeypatch: pytest.MonkeyPatch) -> None:
    here = machine()
    key = store.key_of(TEXT, here)
    for name in here:
        assert store.key_of(TEXT, {**here, name: "other"}) != key
    assert store.key_of(TEXT + " ", here) != key
    monkeypatch.setattr(store, "MAGIC", b"xpheve kernel 2\n")
    assert store.key_of(TEXT, here) != key


# Owners --------------------------------------------------------------------------------------------------------------


@posix
@pytest.mark.parametrize("mode", [0o770, 0o707, 0o777])
def test_a_folder_that_others_may_write_to_is_neither_read_nor_written(
    entry: Path, cache: Path, mode: int, forget: Forget
) -> None:
    cache.chmod(mode)
    before = entry.stat()
    with pytest.warns(CompileWarning, match=r"not the user's own, or others may write to it; .*XPHEVE_CACHE_DIR"):
        kernel = compiled(TEXT)
    assert kernel.origin == "memory" and kernel.path == "" and right(kernel)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # said once, no more
        assert compiled(OTHER).origin == "memory"
    after = entry.stat()
    assert (after.st_mtime_ns, after.st_ino) == (before.st_mtime_ns, before.st_ino) and len(list(cache.iterdir())) == 1


@posix
def test_a_folder_of_another_user_is_neither_read_nor_written(
    entry: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mine = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: mine + 1)
    with pytest.warns(CompileWarning, match="not the user's own"):
        assert compiled(TEXT).origin == "memory"
    assert len(list(cache.iterdir())) == 1


@posix
def test_a_link_to_a_folder_laid_by_another_user_is_not_followed(
    entry: Path, cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, forget: Forget
) -> None:
    cache.rename(tmp_path / "real")
    cache.symlink_to(tmp_path / "real")
    assert compiled(TEXT).origin == "cache"  # the user's own link to the user's own folder
    forget()
    real = os.lstat

    def lstat(path: str) -> os.stat_result:
        found = real(path)
        return os.stat_result([*found[:4], found.st_uid + 1, *found[5:10]]) if Path(path) == cache else found

    monkeypatch.setattr(os, "lstat", lstat)
    with pytest.warns(CompileWarning, match="not the user's own"):
        assert compiled(TEXT).origin == "memory"


@posix
@pytest.mark.parametrize("how", ["link", "mode"])
def test_a_file_that_is_a_link_or_that_others_may_write_is_a_miss(
    entry: Path, tmp_path: Path, how: str, forget: Forget
) -> None:
    if how == "mode":
        entry.chmod(0o666)
    else:
        entry.rename(tmp_path / "real")
        entry.symlink_to(tmp_path / "real")
    assert compiled(TEXT).origin == "compiled"
    forget()
    assert compiled(TEXT).origin == "cache" and not entry.is_symlink()


# Writing that fails --------------------------------------------------------------------------------------------------


def refuse(monkeypatch: pytest.MonkeyPatch, wrong: OSError) -> None:
    """As on a file system where nothing can be made or changed; what may be done as root does not count."""
    real = os.open

    def opened(path: object, flags: int, *rest: object, **more: object) -> int:
        if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT):
            raise wrong
        return real(path, flags, *rest, **more)  # type: ignore[arg-type]

    def never(*_: object, **__: object) -> None:
        raise wrong

    monkeypatch.setattr(os, "open", opened)
    for name in ("mkdir", "makedirs", "replace", "utime", "unlink"):
        monkeypatch.setattr(os, name, never)


def test_a_read_only_warm_cache_is_read_without_a_word(
    entry: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.utime(entry, (1e9, 1e9))
    entry.chmod(0o400)
    cache.chmod(0o500)
    refuse(monkeypatch, PermissionError(13, "Permission denied"))
    try:
        kernel = compiled(TEXT)
        assert kernel.origin == "cache" and right(kernel)
        with pytest.warns(CompileWarning, match=r"cannot be kept: .*Permission denied"):
            assert compiled(OTHER).origin == "memory"
    finally:
        cache.chmod(0o700)


def test_a_read_only_warm_cache_is_read_by_another_process(entry: Path, cache: Path, process: Process) -> None:
    entry.chmod(0o400)
    cache.chmod(0o500)
    try:
        said = process(
            f"import sys\nfrom xpheve.compile import compiled\nprint(compiled({TEXT!r}).origin, 'numba' in sys.modules)"
        ).stdout
    finally:
        cache.chmod(0o700)
    assert said == "cache False\n"


@pytest.mark.parametrize(
    "wrong",
    [
        PermissionError(13, "Permission denied"),
        OSError(28, "No space left on device"),
        OSError(30, "Read-only file system"),
    ],
)
def test_where_nothing_can_be_written_code_is_compiled_in_memory_and_said_once(
    cache: Path, monkeypatch: pytest.MonkeyPatch, wrong: OSError
) -> None:
    with monkeypatch.context() as patch:
        refuse(patch, wrong)
        with pytest.warns(CompileWarning, match=str(wrong.strerror)) as said:
            first = compiled(TEXT)
            second = compiled(OTHER)
        assert len(said) == 1 and first.origin == second.origin == "memory" and right(first)
    assert not cache.exists()


def test_a_disk_that_fills_while_writing_leaves_nothing_behind(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = os.replace
    cache.mkdir(0o700, parents=True)

    def full(source: str, target: str) -> None:
        if os.path.dirname(target) == str(cache):
            raise OSError(28, "No space left on device")
        real(source, target)

    monkeypatch.setattr(os, "replace", full)
    with pytest.warns(CompileWarning, match="No space left"):
        assert right(compiled(TEXT))
    assert list(cache.iterdir()) == []


def test_a_file_where_the_folder_should_be(cache: Path) -> None:
    cache.parent.mkdir()
    cache.write_text("not a folder")
    with pytest.warns(CompileWarning, match="is not a folder"):
        assert right(compiled(TEXT))
    assert cache.read_text() == "not a folder"


def test_a_user_without_a_home_compiles_in_memory(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("XPHEVE_CACHE_DIR")
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    monkeypatch.chdir(tmp_path)
    with pytest.warns(CompileWarning, match="no home"):
        assert right(compiled(TEXT))
    assert list(tmp_path.iterdir()) == []


# Processes and settings ----------------------------------------------------------------------------------------------

SCRIPT = f"""
import sys
import numpy as np
from xpheve.compile import compiled
x = np.array([2.0])
kernel = compiled({TEXT!r})
assert kernel([x], []) == 21
print(kernel.origin, x.tobytes().hex())
"""


def test_two_processes_at_once_on_a_cold_cache(cache: Path, tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    command = [sys.executable, "-W", "error", str(script)]
    running = [subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    said = [process.communicate(timeout=120) for process in running]
    assert [process.returncode for process in running] == [0, 0], said
    assert len({out.split()[1] for out, _ in said}) == 1
    assert {out.split()[0] for out, _ in said} <= {"compiled", "cache"}
    assert [path.suffix for path in cache.iterdir()] == [".kernel"]
    assert compiled(TEXT).origin == "cache"


@pytest.mark.parametrize("xdg", ["", "relative", "/nowhere/at/all"])
@pytest.mark.parametrize("numba", ["", "relative", "/proc/version/none", "\n*?"])
def test_settings_meant_for_others_neither_move_nor_break_nor_litter(
    tmp_path: Path, process: Process, xdg: str, numba: str
) -> None:
    home = tmp_path / "home"
    home.mkdir()
    settings = {"HOME": str(home), "USERPROFILE": str(home), "LOCALAPPDATA": str(home), "XPHEVE_CACHE_DIR": ""}
    origins = [
        process(SCRIPT, **settings, XDG_CACHE_HOME=xdg, NUMBA_CACHE_DIR=numba).stdout.split()[0] for _ in range(2)
    ]
    assert origins == ["compiled", "cache"]
    assert list((tmp_path / "here").iterdir()) == []
    found = [path for path in home.rglob("*") if path.is_file()]
    assert [path.suffix for path in found] == [".kernel"] and found[0].parent.name == "kernels"


# Clearing up ---------------------------------------------------------------------------------------------------------


def test_what_was_abandoned_and_what_is_oldest_goes(entry: Path, cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (cache / ".half.1.a").write_bytes(b"x")
    (cache / ".half.2.b").write_bytes(b"x")
    os.utime(cache / ".half.1.a", (1e9, 1e9))
    (cache / "notes").write_text("mine")
    os.utime(entry, (1e9, 1e9))
    monkeypatch.setattr(store, "KEPT_BYTES", entry.stat().st_size + 100)
    newer = Path(compiled(OTHER).path)
    assert sorted(path.name for path in cache.iterdir()) == sorted([".half.2.b", "notes", newer.name])


def test_an_entry_that_is_used_is_not_old(entry: Path) -> None:
    os.utime(entry, (1e9, 1e9))
    assert compiled(TEXT).origin == "cache"
    assert entry.stat().st_mtime > 1.5e9
