"""Where what was found on smooth motion stands."""

from __future__ import annotations

from benchmarks.pages import Section

SECTION = Section(
    "smooth", "<!-- smooth motion: written by benchmarks/smooth/run --page -->", "<!-- end of smooth motion -->"
)
