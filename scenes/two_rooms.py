#!/usr/bin/env python3
"""Writes two rooms with a doorway between them and a lamp in one only: light reaches the other by bounces.

    python3 two_rooms.py OUT_DIR

The lit room is a study, the dark one a place to sit. Everything the dark room receives comes through one opening of
0.95 x 2.1 m, so errors at the border between two cells show here first.
"""

import random

import furniture
import rooms
from model import Material, Model, main

HEIGHT = 2.7
WALL = 0.2
STUDY, PARLOUR = (0.0, 4.6), (4.8, 9.0)  # along x
DEPTH = 4.2
DOORWAY = (1.5, 2.45, 0.0, 2.1)          # along the dividing wall, and its height


def materials():
    colours = rooms.materials() | furniture.materials() | {
        "oak": Material((0.5, 0.34, 0.19)),
        "red_wall": Material((0.58, 0.2, 0.13)),
        "white_wall": Material((0.78, 0.76, 0.71)),
        "rug": Material((0.2, 0.28, 0.36)),
        "lamp": Material((0, 0, 0), ke=(34, 29, 22)),
    }
    colours["night"] = Material((0.04, 0.05, 0.07))
    return colours


def plain_walls(m, x0, x1, sides, material):
    """The walls of a room without holes, seen from inside."""
    corners = {"south": ((x1, 0), (x0, 0)), "north": ((x0, DEPTH), (x1, DEPTH)), "west": ((x0, 0), (x0, DEPTH)),
               "east": ((x1, DEPTH), (x1, 0))}
    for side in sides:
        m.upright(*corners[side], 0, HEIGHT, material)


def shells(m):
    """Both rooms' linings and the wall between them."""
    with m.object("study"):
        m.floor(STUDY[0], 0, STUDY[1], DEPTH, 0, "oak")
        m.ceiling(STUDY[0], 0, STUDY[1], DEPTH, HEIGHT, "soffit")
        plain_walls(m, *STUDY, ("south", "west"), "white_wall")
        hole = (1.5, 3.1, 0.85, 2.1)
        m.sheet(*STUDY, 0, HEIGHT, DEPTH, "white_wall", [hole])
        m.reveals(hole, DEPTH, DEPTH + WALL, "white_wall")
        m.sheet(*hole, DEPTH + WALL, "night")
        with m.placed(y=DEPTH):
            rooms.window(m, hole, mullions=1, transom=1.75)
    with m.object("parlour"):
        m.floor(PARLOUR[0], 0, PARLOUR[1], DEPTH, 0, "oak")
        m.ceiling(PARLOUR[0], 0, PARLOUR[1], DEPTH, HEIGHT, "soffit")
        plain_walls(m, *PARLOUR, ("south", "north"), "white_wall")
        # The wall opposite the doorway is coloured: what the room receives first, it hands on in red.
        plain_walls(m, *PARLOUR, ("east",), "red_wall")
    with m.object("divide"), m.placed(x=STUDY[1], y=DEPTH, turn=-90):
        m.wall((0, DEPTH), (0, DEPTH), HEIGHT, WALL, "white_wall", "white_wall", [DOORWAY], threshold="oak")


def ceiling_lamp(m, x, y):
    """A round luminaire close under the ceiling; its lower face shines."""
    with m.object("lamp"):
        m.frustum(x, y, HEIGHT - 0.16, HEIGHT - 0.06, 0.3, 0.3, 16, "shade", bottom="lamp", top="shade")
        m.frustum(x, y, HEIGHT - 0.06, HEIGHT, 0.05, 0.05, 8, "shade")


def build():
    m = Model(materials())
    rng = random.Random(2)
    shells(m)
    ceiling_lamp(m, 2.1, 2.0)
    with m.object("study"):
        with m.placed(x=2.3, y=3.55):
            furniture.workplace(m, swing=25)
        with m.placed(x=0.05, y=1.5, turn=90):
            furniture.shelf(m, random=rng)
        with m.placed(x=3.6, y=0.05, turn=180):
            furniture.cabinet(m, height=0.8)
    with m.object("parlour"):
        m.box((5.3, 0.9, 0), (8.2, 2.9, 0.02), "rug", skip="-z")
        with m.placed(x=6.75, y=1.9, z=0.02):
            furniture.table(m, 1.0, 0.7, height=0.45)
            for x, turn in ((-1.0, -90), (1.0, 90)):
                with m.placed(x=x, turn=turn + 10):
                    furniture.chair(m, "fabric_red" if x > 0 else "fabric")
        with m.placed(x=6.0, y=DEPTH - 0.02):
            furniture.shelf(m, random=rng)
        with m.placed(x=8.45, y=3.65):
            furniture.tree(m, height=1.7, tub=0.3)
    return m


CAMERAS = [
    ("dark", (8.7, 0.35, 1.6), (4.9, 2.9, 1.15), 62),
    ("lit", (4.3, 0.4, 1.6), (1.0, 3.4, 1.1), 66),
    ("through", (2.5, 1.45, 1.55), (9.0, 2.95, 0.95), 52),
]

if __name__ == "__main__":
    main(__doc__, "two_rooms", build, 0.2, CAMERAS, "Two rooms, one lamp, one doorway. Written by two_rooms.py.")
