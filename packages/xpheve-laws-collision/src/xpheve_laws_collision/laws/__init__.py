"""Collision laws: what touching, approaching bodies do."""
