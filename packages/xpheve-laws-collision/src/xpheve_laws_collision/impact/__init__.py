"""The compiled event loop of spheres that fly ballistically among fixed scenery."""
