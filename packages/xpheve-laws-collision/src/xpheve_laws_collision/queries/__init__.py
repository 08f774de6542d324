"""Queries for hosts: what a ray meets, what is nearest, what overlaps, what a moved shape comes to. See `xpheve.queries`.

Its rooms: `places` (the objects at an instant, as arrays), `tree` (which of many boxes a ray may meet), `casting` (rays and shapes), `surface`
(points and shapes), `separation` (shapes and shapes), `moving` (moved shapes), and `scene`, where they come together.
"""

from xpheve_laws_collision.queries.scene import SceneQueries

__all__ = ["SceneQueries"]
