"""Where what was found on impacts stands."""

from __future__ import annotations

from benchmarks.pages import Section

SECTION = Section("impacts", "<!-- impacts: written by benchmarks/impacts/run --page -->", "<!-- end of impacts -->")
