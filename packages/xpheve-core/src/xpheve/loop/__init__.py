"""The run loop: many steps of second order in one call, for fields and pairs."""
