#!/usr/bin/env python3
"""Writes the courtyard: a stand-in for the test scene of the paper's section 5, whose model is not public.

    python3 courtyard.py OUT_DIR

The original shows the inside of the Rosenthaler Hof in Berlin, the roofed courtyard of an office building at night. This
one keeps what matters for the measurements: a tall hall coupled to many rooms through doors and windows, thin things beside
large ones, twelve light sources of unequal reach (six in the court, six in rooms), most of the building dark.

How it is composed:
- The court is 5 x 10 bays of 3 m and five storeys of 3.6 m: twice as long as wide, and a quarter higher than wide at the
  eaves. Five bays across put an opening, not a column, on the long axis, where the gate and the stair stand.
- Around the court runs a ring of galleries, behind it a ring of rooms. One wing is drawn along x with the court on its
  -y side, and placed four times by quarter turns. In a wing, y counts from the court's edge outwards.
- Rooms are lined from the inside (floor, ceiling, walls are cut at every wall's face), so no patch reaches under a wall.
"""

import random

import courtyard_hall as hall
import courtyard_plan
import furniture
import rooms
from courtyard_plan import (BACK, BAY, BAYS_X, BAYS_Y, CLEAR, FRONT, GALLERY, HALF_X, HALF_Y, PARTITION, STOREY,
                            STOREYS)
from model import Model, main

# Rooms that are lit: (side, storey, room). Six, spread so that every view across the court meets near and far ones.
LIT = {("north", 1, 2), ("north", 3, 0), ("east", 0, 1), ("east", 2, 1), ("west", 1, 3), ("west", 3, 2)}


# --- Fronts ----------------------------------------------------------------------------------------------------------


def bay_holes(x, kind):
    """What one bay of a front is opened with; x is its middle. Doors and windows share their heads: two lines of cuts
    through a front instead of four."""
    if kind == "window":
        return [("window", (x - 1.0, x + 1.0, 0.8, 2.5))]
    if kind == "door":
        return [("door", (x - 1.05, x - 0.1, 0, 2.5)), ("slit", (x + 0.25, x + 1.15, 0.8, 2.5))]
    if kind == "shop":
        return [("shop", (x - 1.2, x + 1.2, 0.4, 2.7))]
    if kind == "shop door":
        return [("door", (x - 1.2, x - 0.2, 0, 2.7)), ("shop slit", (x, x + 1.2, 0.4, 2.7))]
    if kind == "corner window":  # the last two metres beside a corner
        return [("slit", (x - 0.5, x + 0.5, 0.8, 2.5))]
    assert kind == "corner door", kind
    return [("door", (x - 0.45, x + 0.45, 0, 2.5))]


def front(m, front_span, back_span, bays, storey, rng):
    """The wall between a gallery and one room, with what stands in its openings."""
    holes = [hole for x, kind in bays for hole in bay_holes(x, kind)]
    skin = "brick" if storey == 0 else "plaster"
    with m.object("front"), m.placed(y=GALLERY):
        m.wall(front_span, back_span, CLEAR, FRONT, skin, "wall", [hole for _, hole in holes], threshold="stone_dark")
        for kind, hole in holes:
            if kind == "window":
                rooms.window(m, hole, mullions=2, transom=2.05)
            elif kind == "slit":
                rooms.window(m, hole, mullions=0, transom=2.05)
            elif kind == "shop":
                rooms.window(m, hole, mullions=2, transom=2.2, glazed=True)
            elif kind == "shop slit":
                rooms.window(m, hole, mullions=0, transom=2.2, glazed=True)
            elif kind == "door":
                rooms.door(m, hole, ajar=rng.choice((0, 0, 0, 35, 70)))


# --- Rooms -----------------------------------------------------------------------------------------------------------


def furnish(m, x0, x1, kind, rng):
    """Sets the furniture of a room between the walls x0 and x1. An "empty" one is not let yet."""
    seat = rng.choice(("fabric", "fabric", "fabric_red"))
    back, middle = BACK - 0.02, (x0 + x1) / 2
    if kind == "office":
        # Desks stand at right angles to the windows, in pairs face to face where the room is wide enough.
        for x, turn in ((x0 + 1.6, -90), (x1 - 1.6, 90)):
            with m.placed(x=x, y=BACK - 1.5):
                furniture.workplace(m, turn, seat=seat, swing=rng.uniform(-50, 50))
        with m.placed(x=x0 + 0.05, y=GALLERY + FRONT + 1.6, turn=90):
            furniture.shelf(m, boards=3, random=rng)
        with m.placed(x=middle, y=back):
            furniture.cabinet(m, height=0.72)
    elif kind == "meeting":
        with m.placed(x=middle, y=(GALLERY + FRONT + BACK) / 2 + 0.2):
            furniture.meeting(m, seats=2, seat=seat)
        with m.placed(x=middle, y=back):
            furniture.cabinet(m, width=2.4, height=0.72)
    elif kind == "store":
        with m.placed(x=middle, y=back):
            furniture.cabinet(m, width=2.0, height=0.72)
    elif kind == "shop":
        # A counter and a table: seen through large panes from the court.
        with m.placed(x=middle, y=BACK - 1.4):
            furniture.cabinet(m, width=3.2, height=1.0, depth=0.7, body="wood")
        with m.placed(x=x0 + 1.4, y=GALLERY + FRONT + 1.7):
            furniture.table(m, 0.9, 0.9)
            for turn in (90, -90):
                with m.placed(turn=turn), m.placed(y=-0.75):
                    furniture.chair(m, seat)


def room(m, x0, x1, front_x, bays, insets, kind, storey, lit, rng):
    """One room between two partitions' middles x0 and x1, with its front towards the gallery along `front_x`."""
    front(m, front_x, (x0 + insets[0], x1 - insets[1]), bays, storey, rng)
    rooms.shell(m, x0 + insets[0], x1 - insets[1], GALLERY + FRONT, BACK, CLEAR, "tread" if kind == "shop" else "carpet")
    furnish(m, x0 + insets[0], x1 - insets[1], kind, rng)
    if lit:
        rooms.hanging_lamp(m, (x0 + x1) / 2, (GALLERY + FRONT + BACK) / 2 + 0.3, CLEAR)


def gate(m, x0, x1):
    """The way in from the street: a passage through the south wing with a closed gate and a lantern."""
    a, b, y = x0 + PARTITION, x1 - PARTITION, GALLERY + FRONT
    hole = (-1.2, 1.2, 0, 2.7)
    with m.placed(y=GALLERY):
        m.wall((x0, x1), (a, b), CLEAR, FRONT, "brick", "brick", [hole], threshold="paving_dark")
    m.floor(a, y, b, BACK, 0, "paving")
    m.ceiling(a, y, b, BACK, CLEAR, "soffit")
    m.upright((a, y), (a, BACK), 0, CLEAR, "brick")
    m.upright((b, BACK), (b, y), 0, CLEAR, "brick")
    m.sheet(a, b, 0, CLEAR, BACK, "brick", [hole])
    m.reveals(hole, BACK, BACK + 0.3, "brick", "paving_dark")
    m.sheet(*hole, BACK + 0.3, "door")
    for x in (-0.9, -0.3, 0.3, 0.9):  # the gate's panels
        for z in (0.25, 1.05, 1.85):
            m.box((x - 0.22, BACK + 0.26, z), (x + 0.22, BACK + 0.3, z + 0.65), "door", skip="+y")
    with m.object("lamp"):
        m.box((-0.2, y + 1.5, CLEAR - 0.3), (0.2, y + 1.9, CLEAR), "iron", skip="-z +z")
        m.ceiling(-0.2, y + 1.5, 0.2, y + 1.9, CLEAR - 0.3, "lamp_gate")


def long_wing(m, side, storey, rng):
    """East and west: five rooms of two bays, and a room beyond each end that fills the building's corner."""
    kinds = ("shop",) if storey == 0 else ("office", "office", "meeting", "office", "empty")
    bay = ("shop", "shop door") if storey == 0 else ("window", "door")
    for i in range(5):
        x0 = -HALF_Y + 2 * BAY * i
        x1 = x0 + 2 * BAY
        with m.object(f"room{i}"):
            room(m, x0, x1, (x0, x1), [(x0 + BAY / 2, bay[0]), (x1 - BAY / 2, bay[1])], (PARTITION, PARTITION),
                 kinds[(i + storey) % len(kinds)], storey, (side, storey, i) in LIT, rng)
    near, far = HALF_Y, HALF_Y + BACK
    with m.object("room5"):
        room(m, near, far, (near, near + GALLERY), [(near + 1, "corner door")], (PARTITION, 0), "store", storey, False, rng)
    with m.object("room6"):
        room(m, -far, -near, (-near - GALLERY, -near), [(-near - 1, "corner door")], (0, PARTITION), "store", storey,
             False, rng)


def short_wing(m, side, storey, rng):
    """North and south: a room on each side of the axis, and a narrow one (or the gate) on it."""
    end, axis = HALF_X + GALLERY, BAY / 2
    window, door, kind = ("shop", "shop door", "shop") if storey == 0 else ("window", "door", "meeting")
    with m.object("room0"):
        room(m, -end, -axis, (-end, -axis), [(-end + 1, "corner window"), (-6, window), (-3, door)], (0, PARTITION), kind,
             storey, (side, storey, 0) in LIT, rng)
    with m.object("room1"):
        if side == "south" and storey == 0:
            gate(m, -axis, axis)
        else:
            room(m, -axis, axis, (-axis, axis), [(0, door)], (PARTITION, PARTITION), "store", storey,
                 (side, storey, 1) in LIT, rng)
    with m.object("room2"):
        room(m, axis, end, (axis, end), [(3, window), (6, door), (end - 1, "corner window")], (PARTITION, 0), kind, storey,
             (side, storey, 2) in LIT, rng)


# --- The whole -------------------------------------------------------------------------------------------------------


def build():
    m = Model(courtyard_plan.materials())
    rng = random.Random(145588)  # swings chairs, fills shelves; the same building every time
    sides = (("north", 0, HALF_Y, BAYS_X), ("east", -90, HALF_X, BAYS_Y),
             ("south", 180, HALF_Y, BAYS_X), ("west", 90, HALF_X, BAYS_Y))
    for storey in range(STOREYS):
        for side, turn, distance, bays in sides:
            with m.placed(z=storey * STOREY, turn=turn), m.placed(y=distance), m.object(f"{side}{storey}"):
                (short_wing if bays == BAYS_X else long_wing)(m, side, storey, rng)
                arrival = {1: 1, 0: -1}[storey % 2] if side == "north" and storey else None
                with m.object("gallery"):
                    hall.gallery(m, storey, bays, arrival)
    hall.paving(m)
    hall.stair(m)
    hall.furniture_of_court(m)
    hall.roof(m)
    return m


CAMERAS = [
    ("court", (-2.6, -15.6, 5.4), (0.6, 14, 8.3), 62),
    ("gallery", (-8.4, -8.3, 12.5), (4.0, 9.0, 8.6), 58),
    ("office", (14.75, 3.3, 8.9), (9.4, 7.4, 8.25), 64),
]

if __name__ == "__main__":
    main(__doc__, "courtyard", build, 0.68, CAMERAS, "Stand-in for the paper's section 5: a roofed courtyard at night.",
         element=0.68)  # 145 588 patches within 1 %; a patch receives as one, as in the paper
