"""The courtyard's hall: galleries, stair, paving, trees and lamps, roof."""

import math

import furniture
from courtyard_plan import (BAY, BAYS_X, BAYS_Y, BEAM, CLEAR, EAVES, GALLERY, HALF_X, HALF_Y, RIDGE, STOREY,
                            STOREYS)


# --- Galleries -------------------------------------------------------------------------------------------------------


def column(m, x, base):
    """Eight sides between floor and beam, under a square head; on the ground also on a square foot."""
    y, top, r = BEAM[0] / 2, STOREY - BEAM[1], 0.15
    with m.object("column"):
        if base:
            m.box((x - r, y - r, 0), (x + r, y + r, base), "column", skip="-z")
        m.frustum(x, y, base, top - 0.12, 0.13, 0.12, 8, "column")
        m.box((x - r, y - r, top - 0.12), (x + r, y + r, top), "column", skip="+z")


def railing(m, p, q, posts, height=1.05, rails=3):
    """A railing from p to q (points on the floor; it may climb): handrail, thin rails, `posts` evenly between the ends.
    Its ends meet a column, a wall or a post, so rails have no end faces."""
    point = lambda t, z: (p[0] + (q[0] - p[0]) * t, p[1] + (q[1] - p[1]) * t, p[2] + (q[2] - p[2]) * t + z)
    with m.object("railing"):
        m.beam(point(0, height), point(1, height), 0.07, 0.05, "rail", ends=False)
        for i in range(1, rails):
            m.beam(point(0, height * i / rails), point(1, height * i / rails), 0.025, 0.025, "rail", ends=False)
        for i in range(posts):
            x, y, z = point((i + 1) / (posts + 1), 0)
            m.box((x - 0.02, y - 0.02, z), (x + 0.02, y + 0.02, z + height - 0.05), "rail", skip="-z +z")


def post(m, x, y, z, height=1.12):
    """The thicker post at a railing's free end."""
    m.box((x - 0.04, y - 0.04, z), (x + 0.04, y + 0.04, z + height), "rail", skip="-z")


def gallery(m, storey, bays, stair=None):
    """One side's gallery of one storey: floor, soffit, ring beam towards the court, columns and railings.

    The corner on its right belongs to it, the one on its left to its neighbour. `stair` is the bay (-1 left, 1 right of
    the axis) that a landing opens."""
    xs = [(i - bays / 2) * BAY for i in range(bays + 1)]
    (width, drop), soffit, end = BEAM, CLEAR, xs[-1]
    edge, floor = STOREY - drop, "paving" if storey == 0 else "gallery"
    for a, b in zip(xs, xs[1:]):
        m.floor(a, 0, b, GALLERY, 0, floor)
        m.ceiling(a, width, b, GALLERY, soffit, "soffit")
        # The beam's court face reaches up to the next floor.
        m.upright((a, 0), (b, 0), edge, STOREY, "fascia")
        m.ceiling(a, 0, b, width, edge, "fascia")
        m.upright((b, width), (a, width), edge, soffit, "fascia")
    m.floor(end, 0, end + GALLERY, GALLERY, 0, floor)
    m.ceiling(end, 0, end + width, width, edge, "fascia")
    m.upright((end + width, width), (end, width), edge, soffit, "fascia")
    m.upright((end + width, 0), (end + width, width), edge, soffit, "fascia")
    m.ceiling(end, width, end + width, GALLERY, soffit, "soffit")
    m.ceiling(end + width, width, end + GALLERY, GALLERY, soffit, "soffit")
    m.ceiling(end + width, 0, end + GALLERY, width, soffit, "soffit")

    # Columns stand under the beam's middle, so those of the corners stand half a beam further out.
    line = width / 2
    places = [xs[0] - line, *xs[1:-1], end + line]
    for x in places[1:]:
        column(m, x, 0.5 if storey == 0 else 0)
    if storey == 0:
        return
    for a, b in zip(places, places[1:]):
        a, b = a + 0.11, b - 0.11
        if stair and stair * (a + b) / 2 == BAY:
            # Closed up to the landing, open from there to the next column.
            inner, outer = (a, LANDING[0] - 0.1) if stair > 0 else (-LANDING[0] + 0.1, b)
            railing(m, (inner, line, 0), (outer, line, 0), posts=0)
            post(m, stair * (LANDING[0] - 0.1), line, 0)
        else:
            railing(m, (a, line, 0), (b, line, 0), posts=2)


# --- Stair -----------------------------------------------------------------------------------------------------------

LANDING = (2.8, 4.3)          # along x, on either side of the axis
LANES = ((12.0, 13.4), (13.5, 14.9))  # along y: even flights climb to the right in front, odd ones to the left behind
RISERS = 20


def flight(m, storey):
    """One storey's flight of open treads between two stringers, with railings."""
    y0, y1 = LANES[storey % 2]
    turn = 1 if storey % 2 == 0 else -1
    x0, x1, z0, z1 = -turn * LANDING[0], turn * LANDING[0], storey * STOREY, (storey + 1) * STOREY
    rise, going = STOREY / RISERS, (x1 - x0) / (RISERS - 1)
    with m.object(f"flight{storey}"):
        for i in range(RISERS - 1):
            a, b = sorted((x0 + i * going, x0 + (i + 1) * going + 0.02 * turn))
            z = z0 + (i + 1) * rise
            m.box((a, y0 + 0.07, z - 0.05), (b, y1 - 0.07, z), "tread")
        for y in (y0 + 0.03, y1 - 0.03):
            # The stringer's upper edge runs a hand above the treads' noses.
            m.beam((x0 + 0.01 * turn, y, z0 + 0.26), (x1 - 0.01 * turn, y, z1 + 0.08), 0.06, 0.26, "rail")
            railing(m, (x0, y, z0 + 0.26), (x1, y, z1 + 0.08), posts=5, height=0.95)


def landing(m, storey):
    """The platform where the flight below arrives and the next departs, flush with the gallery behind it."""
    turn = 1 if storey % 2 == 1 else -1
    x0, x1 = sorted((turn * LANDING[0], turn * LANDING[1]))
    y0, z, top = LANES[0][0], storey * STOREY, storey == STOREYS - 1
    with m.object(f"landing{storey}"):
        m.box((x0, y0, z - 0.2), (x1, HALF_Y, z), "gallery", skip="+y")
        inner, outer, line = turn * (LANDING[0] + 0.05), turn * (LANDING[1] - 0.05), y0 + 0.05
        behind = line + 0.04  # a rail that meets another at a post starts behind its width
        railing(m, (inner, line, z), (outer, line, z), posts=1)
        railing(m, (outer, behind, z), (outer, HALF_Y, z), posts=2)
        post(m, inner, line, z)
        post(m, outer, line, z)
        if top:  # nothing departs from here
            railing(m, (inner, behind, z), (inner, LANES[0][1], z), posts=0)
            post(m, inner, LANES[0][1], z)
        # Two legs carry it from the landing below (two storeys down) or from the floor.
        foot = max(0, z - 2 * STOREY)
        for x in (x0 + 0.12, x1 - 0.12):
            m.box((x - 0.07, y0 + 0.1, foot), (x + 0.07, y0 + 0.24, z - 0.2), "rail", skip="-z +z")


def stair(m):
    """The free-standing stair before the north gallery. Its flights cross like scissors and are seen from the side."""
    with m.object("stair"):
        for storey in range(STOREYS - 1):
            flight(m, storey)
            landing(m, storey + 1)


# --- Court -----------------------------------------------------------------------------------------------------------


def lines(bays):
    """Cuts of the paving along one direction: a dark band of 0.4 m on every column's line, two slabs in every bay."""
    cuts, kinds = [-bays * BAY / 2], []
    for i in range(bays):
        x = (i - bays / 2) * BAY
        cuts += [x + 0.2, x + BAY / 2, x + BAY - 0.2]
        kinds += ["band", "slab", "slab"]
    return cuts + [bays * BAY / 2], kinds + ["band"]


def paving(m):
    """Bands repeat the columns' grid on the floor; the slabs between alternate, lighter on the axis."""
    (xs, across), (ys, along) = lines(BAYS_X), lines(BAYS_Y)
    with m.object("paving"):
        for i, (x0, x1) in enumerate(zip(xs, xs[1:])):
            for j, (y0, y1) in enumerate(zip(ys, ys[1:])):
                band = across[i] == "band" or along[j] == "band"
                axis = abs(x0 + x1) < BAY
                light = axis or (i // 3 + j // 3) % 2
                m.floor(x0, y0, x1, y1, 0, "paving_dark" if band else "paving_light" if light else "paving")


def fountain(m, x, y):
    """A low basin on the axis: rim, inner side and water."""
    sides = 16
    with m.object("fountain"), m.placed(x=x, y=y):
        ring = lambda r, z: [(r * math.cos(2 * math.pi * i / sides), r * math.sin(2 * math.pi * i / sides), z)
                             for i in range(sides)]
        foot, rim, lip, water = ring(1.5, 0), ring(1.6, 0.5), ring(1.3, 0.5), ring(1.3, 0.38)
        for i in range(sides):
            j = (i + 1) % sides
            m.face([foot[i], foot[j], rim[j], rim[i]], "column")
            m.face([rim[i], rim[j], lip[j], lip[i]], "column")
            m.face([lip[i], lip[j], water[j], water[i]], "column")
        m.face(water, "water")
        m.frustum(0, 0, 0.38, 1.2, 0.16, 0.1, 8, "column")
        m.frustum(0, 0, 1.2, 1.4, 0.12, 0.55, 12, "column", bottom="column", top="water")


def pendant(m, x, y, z):
    """A bell on a cable from the roof; its round lower face shines."""
    with m.object("lamp"):
        m.frustum(x, y, z, z + 0.2, 0.62, 0.6, 16, "shade", bottom="lamp_pendant")
        m.frustum(x, y, z + 0.2, z + 0.7, 0.6, 0.15, 16, "shade", top="shade")
        m.box((x - 0.015, y - 0.015, z + 0.7), (x + 0.015, y + 0.015, RIDGE - 0.4), "shade", skip="-z +z")


def uplight(m, x, y):
    """A bowl on a foot that lights galleries' undersides and the roof; its upper face shines."""
    with m.object("lamp"):
        m.frustum(x, y, 0, 0.9, 0.16, 0.12, 8, "iron")
        m.frustum(x, y, 0.9, 1.25, 0.14, 0.5, 12, "iron", bottom="iron", top="lamp_up")


def furniture_of_court(m):
    """Trees and benches in two rows beside the axis, lamps between them."""
    with m.object("court"):
        for side in (-1, 1):
            for i, y in enumerate((-12.0, -6.0, 0.0, 6.0)):
                with m.placed(x=side * 4.5, y=y):
                    furniture.tree(m, height=3.6 if i % 2 else 3.3)
            for y in (-9.0, 3.0):
                with m.placed(x=side * 4.5, y=y, turn=90):
                    furniture.bench(m)
            uplight(m, side * 4.5, -3.0)
        fountain(m, 0, -3.0)
        for y in (-7.5, 0, 7.5):
            pendant(m, 0, y, 13.3)


# --- Roof ------------------------------------------------------------------------------------------------------------


def roof(m):
    """A glazed saddle roof on a truss at every column's line; the panes show the night."""
    ys = [(i - BAYS_Y / 2) * BAY for i in range(BAYS_Y + 1)]
    top = STOREYS * STOREY
    at = lambda t, down: (HALF_X * (1 - t), EAVES + (RIDGE - EAVES) * t - down)  # x and z up the right slope
    with m.object("roof"):
        for turn, bays in ((0, BAYS_X), (180, BAYS_X), (90, BAYS_Y), (-90, BAYS_Y)):
            y = HALF_Y if bays == BAYS_X else HALF_X
            with m.placed(turn=turn):
                for i in range(bays):
                    x = (i - bays / 2) * BAY
                    m.upright((x, y), (x + BAY, y), top, EAVES, "fascia")
        for turn in (0, 180):
            with m.placed(turn=turn):
                m.face([(-HALF_X, HALF_Y, EAVES), (HALF_X, HALF_Y, EAVES), (0, HALF_Y, RIDGE)], "plaster")
                for a, b in zip(ys, ys[1:]):
                    m.face([(HALF_X, a, EAVES), (HALF_X, b, EAVES), (0, b, RIDGE), (0, a, RIDGE)][::-1], "night")
                for y in ys[1:-1]:
                    (x0, z0), (x1, z1) = at(0, 0.03), at(1, 0.03)
                    m.beam((x0, y, z0), (x1, y, z1), 0.12, 0.3, "iron", ends=False)
                for t in (0.25, 0.5, 0.75):
                    x, z = at(t, 0.06)
                    m.box((x - 0.05, -HALF_Y, z - 0.16), (x + 0.05, HALF_Y, z), "iron", skip="-y +y")
                for a in ys[:-1]:
                    for i in (1, 2):
                        (x0, z0), (x1, z1) = at(0, 0.01), at(1, 0.01)
                        m.beam((x0, a + i, z0), (x1, a + i, z1), 0.04, 0.07, "iron", ends=False)
        for y in ys[1:-1]:
            m.beam((-HALF_X, y, EAVES + 0.1), (HALF_X, y, EAVES + 0.1), 0.05, 0.07, "iron", ends=False)
            m.box((-0.03, y - 0.03, EAVES + 0.1), (0.03, y + 0.03, RIDGE - 0.4), "iron", skip="-z +z")
        m.box((-0.08, -HALF_Y, RIDGE - 0.4), (0.08, HALF_Y, RIDGE - 0.1), "iron", skip="-y +y")
        clock(m, HALF_Y, EAVES + 1.2)


def clock(m, y, z):
    """A clock in the north gable, where the eye ends that follows the axis upwards. Ten past ten."""
    r, sides = 0.95, 24
    point = lambda i, depth: (r * math.sin(2 * math.pi * i / sides), y - depth, z + r * math.cos(2 * math.pi * i / sides))
    with m.object("clock"):
        m.face([point(-i, 0.08) for i in range(sides)], "clock")
        for i in range(sides):
            m.face([point(i, 0), point(i, 0.08), point(i + 1, 0.08), point(i + 1, 0)], "rail")
        for angle, length, depth in ((305, 0.5, 0.11), (60, 0.75, 0.1)):
            s, c = math.sin(math.radians(angle)), math.cos(math.radians(angle))
            corner = lambda along, side: (along * s + side * c, y - depth, z + along * c - side * s)
            m.face([corner(-0.1, -0.035), corner(-0.1, 0.035), corner(length, 0.02), corner(length, -0.02)], "shade")
