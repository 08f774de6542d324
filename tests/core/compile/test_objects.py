"""Names that object code needs from elsewhere, read from the symbol tables of three systems."""

from __future__ import annotations

import llvmlite.binding as llvm
import pytest

from xpheve.compile.objects import undefined_symbols

PROCESSOR = llvm.get_process_triple().partition("-")[0]
SYSTEMS = [f"{PROCESSOR}-unknown-linux-gnu", f"{PROCESSOR}-apple-darwin", f"{PROCESSOR}-pc-windows-msvc"]

TEXT = """
declare double @exp(double)
declare double @a_name_longer_than_eight_letters(double)
declare double @never_called(double)
@common = common global i64 0
define double @entry(double %x) {
  %a = call double @exp(double %x)
  %b = call double @a_name_longer_than_eight_letters(double %a)
  %c = call double @inner(double %b)
  %n = load i64, i64* @common
  %d = sitofp i64 %n to double
  %e = fadd double %c, %d
  ret double %e
}
define internal double @inner(double %x) noinline {
  ret double %x
}
"""


def object_code(triple: str, text: str = TEXT) -> bytes:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_triple(triple).create_target_machine()
    module = llvm.parse_assembly(text.replace("i64* @", "ptr @") if int(llvm.llvm_version_info[0]) >= 15 else text)
    return bytes(target.emit_object(module))


@pytest.mark.parametrize("triple", SYSTEMS)
def test_undefined_names_are_found_in_the_object_files_of_all_systems(triple: str) -> None:
    assert undefined_symbols(object_code(triple)) - {"_fltused"} == {"exp", "a_name_longer_than_eight_letters"}


@pytest.mark.parametrize("triple", SYSTEMS)
def test_an_object_file_cut_short_is_an_error_or_needs_no_less(triple: str) -> None:
    code = object_code(triple)
    for length in range(0, len(code), 7):
        try:
            found = undefined_symbols(code[:length])
        except ValueError:
            continue
        assert found <= {"exp", "a_name_longer_than_eight_letters", "_fltused"}


@pytest.mark.parametrize("code", [b"", b"\x7fELF", b"\x7fELF\x01\x01" + bytes(100), b"words" * 20])
def test_what_is_no_object_file_is_an_error(code: bytes) -> None:
    with pytest.raises(ValueError, match="object file"):
        undefined_symbols(code)
