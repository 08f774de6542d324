"""From impact to impact: spheres among fixed scenery, in one loop that is compiled where they are many."""
