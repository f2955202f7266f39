#!/usr/bin/env python3
"""Writes a floor of an office building: a corridor, eight rooms, lamps in most of them.

    python3 office_floor.py OUT_DIR

Beside being a plausible place it holds one of each thing a second pass must show: a mirror (a wall of room 6), a glass pane
(the meeting room's front, room 2) and a texture (the parquet of room 4). Rooms 1 and 7 are dark.
"""

import random

import furniture
import rooms
from model import Material, Model, main, write_png

HEIGHT = 2.8
BAY = 6.0            # room width, middle of wall to middle of wall
ROOMS = 4            # on each side of the corridor
DEPTH = 5.0
CORRIDOR = 1.0       # half its width
WALL, HALF = 0.15, 0.07
TILE = 1.2           # one repeat of the parquet
DARK = {1, 7}
# Rooms 0-3 lie north of the corridor, 4-7 south, both counted from the west.
KINDS = ("office", "office", "meeting", "office", "lounge", "archive", "fitting", "office")


def materials():
    return rooms.materials() | furniture.materials() | {
        "linoleum": Material((0.3, 0.2, 0.14)),
        "accent": Material((0.55, 0.33, 0.1)),
        "parquet": Material((1, 1, 1), map_kd="parquet.png"),
        "mirror": Material((0, 0, 0), ks=(0.92, 0.92, 0.92), illum=3),
        "lamp_room": Material((0, 0, 0), ke=(30, 28, 24)),
        "lamp_corridor": Material((0, 0, 0), ke=(24, 19, 13)),
    }


def parquet(x, y, size=96):
    """Basket weave: squares of four boards, turned by quarters, every board with its own tone. Repeats both ways."""
    square = size // 2
    turned = (x // square + y // square) % 2
    across, along = (x % square, y % square) if turned else (y % square, x % square)
    board = across * 4 // square
    tone = (37 * board + 61 * (x // square) + 89 * (y // square)) % 5
    grain = (7 * across + 3 * (along // 6)) % 4
    seam = across * 4 % square < 4 or along == 0
    base = (150, 104, 62) if not seam else (84, 54, 32)
    return tuple(max(0, min(255, c + 6 * tone + 3 * grain - 16)) for c in base)


def holes_of(x, kind):
    """Openings of a room's wall to the corridor: a door, and a pane or a fanlight beside it. x is the wall's middle."""
    door = (x - 2.3, x - 1.35, 0, 2.1)
    if kind == "meeting":
        return door, (x - 1.0, x + 2.4, 0.3, 2.1)
    return door, (x + 0.6, x + 2.2, 1.6, 2.1)


def side(m, first, rng):
    """Four rooms on one side of the corridor, drawn with the corridor on their -y side."""
    length = ROOMS * BAY
    y = CORRIDOR + WALL
    # Seen from the south side's rooms everything is turned about, so their order is too.
    numbers = range(first, first + ROOMS) if first == 0 else range(first + ROOMS - 1, first - 1, -1)
    for i, number in enumerate(numbers):
        x0, kind = -length / 2 + i * BAY, KINDS[number]
        a, b, middle = x0 + HALF, x0 + BAY - HALF, x0 + BAY / 2
        door, pane = holes_of(middle, kind)
        with m.object(f"room{number}"):
            with m.placed(y=CORRIDOR):
                m.wall((x0, x0 + BAY), (a, b), HEIGHT, WALL, "wall", "wall", (door, pane), threshold="linoleum")
                rooms.door(m, door, ajar=85 if number in (1, 4, 6) else 40 if number == 3 else 0, y=0.05)
                rooms.window(m, pane, mullions=0 if kind == "meeting" else 1, glazed=kind == "meeting")
            lounge = kind == "lounge"
            rooms.shell(m, a, b, y, y + DEPTH, HEIGHT, "parquet" if lounge else "carpet", every=2.6,
                        tile=TILE if lounge else None, wall="accent" if kind == "office" and number % 3 == 0 else "wall")
            furnish(m, kind, a, b, y, rng)
            if number not in DARK:
                for x in (middle - 1.4, middle + 1.4):
                    rooms.hanging_lamp(m, x, y + DEPTH / 2, HEIGHT, length=1.5, width=0.3, drop=0.35)


def furnish(m, kind, a, b, y, rng):
    """Furniture by the room's use; the far wall, with the windows, is at y + DEPTH."""
    far, middle = y + DEPTH, (a + b) / 2
    if kind == "office":
        # Two pairs of desks face to face, their short sides towards the windows.
        for x, turn in ((a + 1.5, -90), (b - 1.5, 90)):
            for depth in (1.3, 3.2):
                with m.placed(x=x, y=far - depth):
                    furniture.workplace(m, turn, seat=rng.choice(("fabric", "fabric_red")), swing=rng.uniform(-60, 60))
        for x in (middle - 0.7, middle + 0.7):
            with m.placed(x=x, y=far - 0.02):
                furniture.cabinet(m, height=0.72)
    elif kind == "meeting":
        with m.placed(x=middle, y=(y + far) / 2):
            furniture.meeting(m, seats=4)
        with m.placed(x=b - 0.05, y=far - 1.5, turn=-90):
            furniture.shelf(m, random=rng)
    elif kind == "archive":
        for i in range(4):
            with m.placed(x=a + 0.05, y=y + 1.0 + i * 1.22, turn=90):
                furniture.shelf(m, random=rng)
        for i in range(4):
            with m.placed(x=b - 0.05, y=y + 1.0 + i * 1.22, turn=-90):
                furniture.shelf(m, random=rng)
        with m.placed(x=middle, y=far - 2.2):
            furniture.table(m, 1.8, 0.9)
    elif kind == "lounge":
        with m.placed(x=middle + 0.6, y=far - 1.7):
            furniture.bench(m)
        with m.placed(x=middle + 0.6, y=far - 2.9):
            furniture.table(m, 1.2, 0.7, height=0.45)
        for x in (a + 0.9, b - 0.9):
            with m.placed(x=x, y=far - 0.9):
                furniture.tree(m, height=1.8, tub=0.35)
        with m.placed(x=middle + 0.6, y=far - 4.0, turn=8):
            furniture.chair(m, "fabric_red")
    elif kind == "fitting":
        # A mirror on the side wall; its frame keeps it two centimetres off the plaster.
        with m.object("mirror"), m.placed(x=b, y=(y + far) / 2, turn=-90):
            m.box((-1.4, -0.02, 0.3), (1.4, 0, 2.2), "steel", skip="-y +y")
            m.upright((-1.4, -0.02), (1.4, -0.02), 0.3, 2.2, "mirror")
        with m.placed(x=a + 1.2, y=far - 1.6, turn=20):
            furniture.chair(m, "fabric_red")
        with m.placed(x=a + 1.3, y=y + 1.6, turn=90):
            furniture.bench(m, length=1.8)
        with m.placed(x=middle, y=far - 0.02):
            furniture.cabinet(m, width=2.2, height=0.72)
        with m.placed(x=b - 0.9, y=far - 0.8):
            furniture.tree(m, height=1.8, tub=0.35)


def corridor(m):
    """Floor, ceiling, end walls and four lamps."""
    end = ROOMS * BAY / 2
    with m.object("corridor"):
        for i in range(ROOMS):
            a = -end + i * BAY
            m.floor(a, -CORRIDOR, a + BAY, CORRIDOR, 0, "linoleum")
            m.ceiling(a, -CORRIDOR, a + BAY, CORRIDOR, HEIGHT, "soffit")
            with m.object("lamp"):
                x = a + BAY / 2
                m.box((x - 0.6, -0.15, HEIGHT - 0.08), (x + 0.6, 0.15, HEIGHT), "shade", skip="-z +z")
                m.ceiling(x - 0.6, -0.15, x + 0.6, 0.15, HEIGHT - 0.08, "lamp_corridor")
        for turn in (90, -90):
            with m.placed(turn=turn):
                hole = (-0.6, 0.6, 0.4, 2.3)
                m.sheet(-CORRIDOR, CORRIDOR, 0, HEIGHT, end, "accent", [hole])
                m.reveals(hole, end, end + 0.2, "accent")
                m.sheet(*hole, end + 0.2, "night")
        for x in (-6.0, 6.0):
            with m.placed(x=x, y=CORRIDOR - 0.02):
                furniture.cabinet(m, width=1.6, height=0.9, depth=0.35)


def build():
    m = Model(materials())
    rng = random.Random(8)
    corridor(m)
    side(m, 0, rng)
    with m.placed(turn=180):
        side(m, ROOMS, rng)
    return m


CAMERAS = [
    ("corridor", (-11.4, -0.35, 1.6), (2.0, 0.15, 1.3), 60),
    ("meeting", (1.0, -0.7, 1.6), (4.2, 4.0, 1.2), 68),
    ("mirror", (4.6, -1.7, 1.6), (0.6, -4.2, 1.2), 66),
    ("lounge", (-11.5, -1.5, 1.7), (-8.2, -5.4, 0.5), 66),
]

if __name__ == "__main__":
    folder = main(__doc__, "office_floor", build, 0.3, CAMERAS, "A floor of offices with a mirror, a glass pane and a textured "
                  "floor. Written by office_floor.py.")
    write_png(f"{folder}/parquet.png", 96, 96, parquet)
