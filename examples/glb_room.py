"""Balls in a room from a file: a GLB model is loaded, balls bounce in it, and the run is written as an animated GLB.

Run it with ``python examples/glb_room.py [--out DIR] [--quick]``. It writes ``room.glb``, the model; ``run.glb``, which standard viewers
play; and ``glb_room.png`` into DIR (default ``glb-room-out``).

The model has three nodes: a room that is open above, a ramp, and a table whose node is scaled. Each becomes one fixed object, a mesh of
triangles as it stands in the file. Nothing is made convex, so that balls fly under the table. They are found to touch faces, edges
and corners at exact instants; afterwards the distance of every ball from every triangle is measured in every frame, and the
film is read back. No ball comes to rest within these seconds, so that nothing has to be held in place.
"""

from __future__ import annotations

import argparse
import json
import random
import struct
import time
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

import xpheve as xp
from xpheve.meshes import load_objects

SIDE, DEPTH, WALL = 6.0, 4.0, 2.4  # [m]: the room along x and z, and the height of its walls
RADIUS = 0.14  # [m]
BALLS = 14


def main() -> None:
    """Make the model, load it, let balls into it, and check what comes out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--out", type=Path, default=Path("glb-room-out"), help="folder for the model, the film and the picture"
    )
    parser.add_argument("--quick", action="store_true", help="2 s instead of 5 s")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    model().export(options.out / "room.glb")

    engine = xp.PhysicsEngine(up="y")  # as GLB has it
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.81)
    bounce = engine.add_law("collision:elastic", restitution=0.95)
    furniture = engine.add_objects(load_objects(options.out / "room.glb", fixed=True), laws=[bounce])
    balls = [engine.add_object(ball, laws=[gravity, bounce]) for ball in thrown()]

    clock = time.process_time()
    record = engine.run(until=2.0 if options.quick else 5.0, every=1 / 60)
    clock = time.process_time() - clock
    film = record.export_glb(options.out / "run.glb")

    surface = np.concatenate([triangles_of(one) for one in furniture])
    found = ", ".join(f"{one.name} ({len(one.shape.faces)} triangles)" for one in furniture)
    print(f"room.glb: {found}")
    print(
        f"{len(balls)} balls, {engine.time:g} s: {engine.explain().data['contacts']['impacts']} impacts, {clock:.1f} s of computing"
    )
    print(f"error of the energy balance: {record.energy_drift:.1e} of the energy in play")
    print(f"deepest penetration in any frame: {deepest(record, balls, surface):.1e} m")
    print(f"run.glb, read back: {len(trimesh.load(film).graph.nodes_geometry)} objects; ", end="")
    print(f"largest error of a last place: {read_back(film, balls):.1e} m, of 32-bit floats")
    print("model:  ", options.out / "room.glb")
    print("film:   ", film)
    print("picture:", draw(record, balls, furniture, options.out / "glb_room.png"))


def model() -> Any:
    """A room without ceiling, a ramp, and a table drawn in centimetres under a node that scales it."""
    scene = trimesh.Scene()
    room = trimesh.creation.box((SIDE, WALL, DEPTH), trimesh.transformations.translation_matrix((0, WALL / 2, 0)))
    room.invert()  # it is seen from within
    room.update_faces(room.triangles_center[:, 1] < WALL - 1e-9)
    ramp = trimesh.convex.convex_hull([(x, y, z) for z in (-0.8, 0.8) for x, y in ((-3, 0), (-1, 0), (-3, 1.1))])
    top = trimesh.creation.box((180, 8, 100), trimesh.transformations.translation_matrix((0, 80, 0)))
    legs = [
        trimesh.creation.box((10, 76, 10), trimesh.transformations.translation_matrix((x, 38, z)))
        for x in (-80, 80)
        for z in (-40, 40)
    ]
    place = trimesh.transformations.translation_matrix((1.4, 0, -0.4)) @ np.diag([0.01, 0.01, 0.01, 1.0])
    scene.add_geometry(room, node_name="room", geom_name="room")
    scene.add_geometry(ramp, node_name="ramp", geom_name="ramp")
    scene.add_geometry(trimesh.util.concatenate([top, *legs]), node_name="table", geom_name="table", transform=place)
    return scene


def thrown() -> list[xp.PhysicalObject]:
    """Balls above ramp and table, and some that fly low; each thrown somewhere."""
    chance = random.Random(9)
    balls = []
    for k in range(BALLS):
        low = k % 3 == 2
        x, z = -2.6 + 0.4 * k, chance.uniform(-1.2, 1.2) if not low else 1.2
        balls.append(
            xp.PhysicalObject(
                xp.Sphere(RADIUS),
                density=500.0,
                position=(x, 0.4 if low else chance.uniform(1.5, 2.2), z),
                velocity=(chance.uniform(-2, 2), 0.0, -4.0 if low else chance.uniform(-1, 1)),
                name=f"ball {k}",
            )
        )
    return balls


def triangles_of(obj: xp.PhysicalObject) -> np.ndarray:
    """The corners of its triangles in the world [m], shape (k, 3, 3)."""
    points = np.asarray(obj.shape.vertices)[np.asarray(obj.shape.faces)]
    turn = xp.orientation.to_matrix(obj.orientation)
    return points @ turn.T + np.asarray(obj.position)


def deepest(record: xp.Record, balls: list[xp.PhysicalObject], surface: np.ndarray) -> float:
    """How far a ball is in any triangle or in another ball in any frame [m]; 0 if none is."""
    places = np.stack([record[ball].position for ball in balls], axis=1)  # (frames, balls, 3)
    worst = 0.0
    for frame in places:
        one, other = np.triu_indices(len(frame), 1)
        worst = max(worst, 2 * RADIUS - float(np.linalg.norm(frame[one] - frame[other], axis=1).min()))
        for centre in frame:
            nearest = trimesh.triangles.closest_point(surface, np.broadcast_to(centre, (len(surface), 3)))
            worst = max(worst, RADIUS - float(np.linalg.norm(nearest - centre, axis=1).min()))
    assert (np.abs(places[..., 0]) < SIDE / 2).all() and (np.abs(places[..., 2]) < DEPTH / 2).all(), "a ball is out"
    return worst


def read_back(film: Path, balls: list[xp.PhysicalObject]) -> float:
    """How far the last keys of the film are from where the balls are [m]."""
    data = film.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    document, body = json.loads(data[20 : 20 + length]), data[28 + length :]
    names = [node.get("name") for node in document["nodes"]]
    (animation,) = document["animations"]
    last = {}
    for channel in animation["channels"]:
        if channel["target"]["path"] == "translation":
            keys = document["accessors"][animation["samplers"][channel["sampler"]]["output"]]
            begin = document["bufferViews"][keys["bufferView"]].get("byteOffset", 0) + keys.get("byteOffset", 0)
            last[names[channel["target"]["node"]]] = struct.unpack_from("<3f", body, begin + 12 * (keys["count"] - 1))
    return max(float(np.linalg.norm(np.subtract(last[ball.name], ball.position))) for ball in balls)


def draw(record: xp.Record, balls: list[xp.PhysicalObject], furniture: list[xp.PhysicalObject], path: Path) -> Path:
    """The room with the ways of the balls; the walls in front are left out. Beside it the balance of energy."""
    from matplotlib.colors import LightSource
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    figure = Figure(figsize=(13, 6), dpi=110, layout="constrained")
    axes = figure.add_subplot(1, 2, 1, projection="3d", computed_zorder=False)
    axes.set_proj_type("persp")
    towards = np.array([0.41, -0.78, 0.47])  # the camera
    for one in furniture:
        corners = triangles_of(one)[:, :, [0, 2, 1]] * (1, -1, 1)  # matplotlib's z is up
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        corners = corners[normal @ towards > 0]  # what looks away is not seen: the walls in front, for one
        colour = {"room": "#e8e9ec", "ramp": "#e69f00", "table": "#a0703c"}[one.name]
        solid = Poly3DCollection(
            corners,
            facecolors=colour,
            edgecolors=colour,
            alpha=1.0,
            shade=True,
            lightsource=LightSource(200, 50),
            zorder=0 if one.name == "room" else 1,
        )
        axes.add_collection3d(solid)
    for k, ball in enumerate(balls):
        way = record[ball].position[-60:]
        colour = f"C{k % 10}"
        axes.plot(way[:, 0], -way[:, 2], way[:, 1], color=colour, linewidth=1.0, zorder=2)
        x, y, z = way[-1]
        axes.plot([x], [-z], [y], "o", color=colour, markersize=10, zorder=3)
    axes.set(
        xlim=(-SIDE / 2, SIDE / 2),
        ylim=(-DEPTH / 2, DEPTH / 2),
        zlim=(0, WALL),
        xlabel="x [m]",
        ylabel="-z [m]",
        zlabel="y [m]",
    )
    axes.set_box_aspect((SIDE, DEPTH, WALL))
    axes.view_init(elev=28, azim=-62)
    axes.set_title("room.glb, and the last second of each ball")

    panel = figure.add_subplot(1, 2, 2)
    energy = record.energy
    panel.plot(record.time, energy[:, 0], label="kinetic")
    panel.plot(record.time, energy[:, 1], label="potential")
    panel.plot(record.time, -energy[:, 2], label="lost in impacts")
    panel.plot(record.time, energy[:, 0] + energy[:, 1] - energy[:, 2], linewidth=2.5, label="sum")
    panel.set(
        xlabel="time [s]",
        title=f"energy [J]; the sum is right to {record.energy_drift:.0e}",
        ylim=(0, None),
    )
    panel.legend(loc="upper right", bbox_to_anchor=(1.0, 0.9))
    panel.grid(alpha=0.25)
    figure.savefig(path)
    return path


if __name__ == "__main__":
    main()
