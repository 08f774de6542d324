"""Steppers: *how* time passes for the objects that need it."""
