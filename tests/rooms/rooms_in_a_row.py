#!/usr/bin/env python3
"""Writes rooms that stand in a row along x, each with a door to the next and a lamp in the first alone.

    python3 rooms_in_a_row.py OUT_DIR

Writes OUT_DIR/NAME/room.obj, room.mtl and points.csv for the corridor and the pairs of rooms of README.md. The points stand
room after room, twelve in each. The same Python code gives the same bytes.
"""

import os
import sys

WALL = 0.1  # m, between two rooms
LAMP_SIDE = 0.6  # m; it hangs 2 cm below the first room's ceiling
RADIANCE = 100  # W/(m2 sr), of the lamp


class Model:

    def __init__(self):
        self.vertices, self.faces = [], []

    def rectangle(self, material, corner, u, v):
        """Its front looks along u x v."""
        at = len(self.vertices)
        for s, t in ((0, 0), (1, 0), (1, 1), (0, 1)):
            self.vertices.append(tuple(c + s * a + t * b for c, a, b in zip(corner, u, v)))
        self.faces.append((material, [at + 1, at + 2, at + 3, at + 4]))

    def write(self, path, reflectance, points):
        os.makedirs(path, exist_ok=True)
        with open(f"{path}/room.mtl", "w") as file:
            for material in ("wall", "lining"):
                file.write(f"newmtl {material}\nKd {reflectance} {reflectance} {reflectance}\n")
            file.write(f"newmtl lamp\nKd 0 0 0\nKe {RADIANCE} {RADIANCE} {RADIANCE}\n")
        with open(f"{path}/room.obj", "w") as file:
            file.write("mtllib room.mtl\n")
            file.writelines("v %.9g %.9g %.9g\n" % vertex for vertex in self.vertices)
            for material, corners in self.faces:
                file.write(f"usemtl {material}\nf {' '.join(map(str, corners))}\n")
        with open(f"{path}/points.csv", "w") as file:
            file.write("x,y,z,nx,ny,nz\n")
            file.writelines("%.9g,%.9g,%.9g,%g,%g,%g\n" % (place + normal) for place, normal in points)


def across(m, x, depth, height, door, towards):
    """The wall across the row at x, seen from the side `towards` (1 or -1) along x; `door` is (y0, y1, head) or nothing."""
    def piece(y0, y1, z0, z1):
        if towards > 0:
            m.rectangle("wall", (x, y0, z0), (0, y1 - y0, 0), (0, 0, z1 - z0))
        else:
            m.rectangle("wall", (x, y1, z0), (0, y0 - y1, 0), (0, 0, z1 - z0))

    if door is None:
        return piece(0, depth, 0, height)
    y0, y1, head = door
    piece(0, y0, 0, height)
    piece(y1, depth, 0, height)
    piece(y0, y1, head, height)


def doorway(m, x, door):
    """What lines a door from x to x + WALL; of a material of its own, so that a test can turn it over."""
    y0, y1, head = door
    m.rectangle("lining", (x + WALL, y0, 0), (-WALL, 0, 0), (0, 0, head))
    m.rectangle("lining", (x, y1, 0), (WALL, 0, 0), (0, 0, head))
    m.rectangle("lining", (x, y1, head), (WALL, 0, 0), (0, y0 - y1, 0))
    m.rectangle("lining", (x, y0, 0), (WALL, 0, 0), (0, y1 - y0, 0))


def points_of_room(x, size):
    """Nine at desk height and three on a long wall of the room that begins at x: (place, normal)."""
    length, depth, height = size
    points = []
    for i in range(3):
        at = x + length * (0.17 + 0.33 * i)
        points += [((at, depth * (0.17 + 0.33 * j), 0.8), (0, 0, 1)) for j in range(3)]
        points.append(((at, 0.0, 0.5 * height), (0, 1, 0)))
    return points


def lamp_corner(size):
    return (0.5 * (size[0] - LAMP_SIDE), 0.5 * (size[1] + LAMP_SIDE), size[2] - 0.02)


def row(path, size, doors, reflectance):
    """Rooms of `size` (x, y, z); one more than doors."""
    length, depth, height = size
    m, points = Model(), []
    for k in range(len(doors) + 1):
        x = k * (length + WALL)
        m.rectangle("wall", (x, 0, 0), (length, 0, 0), (0, depth, 0))
        m.rectangle("wall", (x, depth, height), (length, 0, 0), (0, -depth, 0))
        m.rectangle("wall", (x + length, 0, 0), (-length, 0, 0), (0, 0, height))
        m.rectangle("wall", (x, depth, 0), (length, 0, 0), (0, 0, height))
        across(m, x, depth, height, doors[k - 1] if k > 0 else None, 1)
        across(m, x + length, depth, height, doors[k] if k < len(doors) else None, -1)
        if k < len(doors):
            doorway(m, x + length, doors[k])
        points += points_of_room(x, size)
    m.rectangle("lamp", lamp_corner(size), (LAMP_SIDE, 0, 0), (0, -LAMP_SIDE, 0))
    m.write(path, reflectance, points)


def corridor():
    """Size of a room, doors, reflectance. The doors go from left to right and back: nobody looks through all of them."""
    width = 1.3
    doors = [(y, y + width, 2.0) for y in (0.2, 0.85, 1.5, 0.85)]
    return (1.6, 3.0, 2.2), [doors[k % 4] for k in range(11)], 0.9


def main(out):
    row(f"{out}/corridor_12", *corridor())
    for name, width in (("2cm", 0.02), ("20cm", 0.2), ("80cm", 0.8), ("2m", 2.0)):
        row(f"{out}/door_{name}", (4.0, 3.0, 2.5), [(0.5, 0.5 + width, 2.0)], 0.6)


if __name__ == "__main__":
    main(sys.argv[1])
