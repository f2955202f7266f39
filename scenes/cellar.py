#!/usr/bin/env python3
"""Writes a cellar: eight vaults in a row, and one bulb over the crates in the first.

    python3 cellar.py OUT_DIR

Most of it is dark, and what light there is has hard edges: a mesh that is as fine everywhere as the shadows want it wastes nearly
all of its elements, so this is where meshes that are refined by the light are compared with uniform ones.
"""

import random

import furniture
import rooms
from model import Material, Model, main

ROOMS = 8
SIZE, HEIGHT, WALL = 4.0, 2.6, 0.25
PITCH = SIZE + WALL
DOORWAY = (0.5, 1.4, 0.0, 2.0)  # along a dividing wall, and its height


def materials():
    return rooms.materials() | furniture.materials() | {
        "plaster": Material((0.55, 0.54, 0.5)),
        "brick": Material((0.4, 0.22, 0.16)),
        "stone": Material((0.33, 0.32, 0.3)),
        "bulb": Material((0, 0, 0), ke=(2600, 2350, 1900)),
    }


def vault(m, number):
    """The linings of a room, without the walls to its neighbours."""
    x0, x1 = number * PITCH, number * PITCH + SIZE
    with m.object(f"vault{number + 1}"):
        m.floor(x0, 0, x1, SIZE, 0, "stone")
        m.ceiling(x0, 0, x1, SIZE, HEIGHT, "plaster")
        m.upright((x1, 0), (x0, 0), 0, HEIGHT, "plaster")
        m.upright((x0, SIZE), (x1, SIZE), 0, HEIGHT, "plaster")
        if number == 0:
            m.upright((x0, 0), (x0, SIZE), 0, HEIGHT, "brick")
        if number == ROOMS - 1:
            m.upright((x1, SIZE), (x1, 0), 0, HEIGHT, "brick")
        else:
            with m.placed(x=x1, y=SIZE, turn=-90):
                m.wall((0, SIZE), (0, SIZE), HEIGHT, WALL, "plaster", "plaster", [DOORWAY], threshold="stone")


def stores(m, number, rng):
    """A shelf at the wall and crates on the floor."""
    x0 = number * PITCH
    with m.object(f"stores{number + 1}"):
        with m.placed(x=x0 + 1.0 + 1.8 * rng.random(), y=0.02, turn=180):
            furniture.shelf(m, random=rng)
        for x, y in ((0.9, 2.6), (2.2, 2.2)):
            with m.placed(x=x0 + x, y=y + 0.4 * rng.random(), turn=90 * rng.random()):
                size = 0.4 + 0.3 * rng.random()
                m.box((0, 0, 0), (size, size, 0.7 * size), "wood", skip="-z")


def build():
    m = Model(materials())
    rng = random.Random(11)
    for number in range(ROOMS):
        vault(m, number)
        stores(m, number, rng)
    with m.object("bulb"):
        m.frustum(1.9, 1.5, HEIGHT - 0.55, HEIGHT - 0.49, 0.03, 0.03, 8, "shade", bottom="bulb", top="shade")
        m.frustum(1.9, 1.5, HEIGHT - 0.49, HEIGHT, 0.008, 0.008, 4, "shade")
    return m


CAMERAS = [
    ("lit", (3.7, 0.4, 1.6), (0.9, 2.9, 0.6), 66),
    ("along", (0.4, 3.6, 1.6), (9.0, 3.0, 1.1), 60),
]

if __name__ == "__main__":
    main(__doc__, "cellar", build, 0.4, CAMERAS, "Eight vaults in a row, one bulb. Written by cellar.py.")
