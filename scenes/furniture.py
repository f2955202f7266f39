"""Things that stand in rooms: desks, chairs, screens, shelves, benches, plants.

Each function draws one piece around its own origin on the floor z = 0; the caller places it. "Front" is the -y side, where
a person sits or stands. Undersides that rest on something are left out (see model.py).
"""


def desk(m, width=1.6, depth=0.8, height=0.74, top="wood", legs="steel"):
    """A top on a panel leg and a drawer box: reads as a desk from every side for sixteen faces."""
    with m.object("desk"):
        x, t = width / 2, 0.03
        m.box((-x, -depth / 2, height - t), (x, depth / 2, height), top)
        m.box((-x + 0.04, -depth / 2 + 0.06, 0), (-x + 0.08, depth / 2 - 0.06, height - t), legs, skip="-z +z")
        m.box((x - 0.46, -depth / 2 + 0.08, 0), (x - 0.05, depth / 2 - 0.06, 0.6), legs, skip="-z")


def screen(m, z=0.74, width=0.56):
    """A monitor that stands on a desk of height z and is seen from -y."""
    with m.object("screen"):
        m.box((-0.03, -0.015, z), (0.03, 0.025, z + 0.16), "plastic", skip="-z +z")
        m.box((-width / 2, -0.02, z + 0.16), (width / 2, 0.03, z + 0.5), "plastic")


def chair(m, seat="fabric"):
    """An office chair that looks along +y: a foot that tapers to the column, seat, back. Chairs are the commonest things
    in a building, so a chair has to do with sixteen faces."""
    with m.object("chair"):
        m.frustum(0, 0, 0, 0.44, 0.28, 0.03, 4, "steel")
        m.box((-0.24, -0.23, 0.44), (0.24, 0.23, 0.5), seat)
        m.box((-0.21, -0.26, 0.56), (0.21, -0.22, 1.02), seat)


def workplace(m, turn=0, top="wood", seat="fabric", swing=0.0):
    """Desk, screen and chair; `swing` turns the chair as its owner left it (degrees)."""
    with m.placed(turn=turn), m.object("workplace"):
        desk(m, top=top)
        with m.placed(x=-0.1, y=0.18):
            screen(m)
        with m.placed(x=-0.1, y=-0.72, turn=swing):
            chair(m, seat)


def table(m, width, depth, height=0.74, top="wood"):
    """A table on two panel legs."""
    with m.object("table"):
        x, y, t = width / 2, depth / 2, 0.04
        m.box((-x, -y, height - t), (x, y, height), top)
        for side in (-1, 1):
            a, b = sorted((side * (x - 0.25), side * (x - 0.3)))
            m.box((a, -y + 0.12, 0), (b, y - 0.12, height - t), "steel", skip="-z +z")


def meeting(m, seats=3, seat="fabric"):
    """A long table with chairs on both sides."""
    with m.object("meeting"):
        width = 0.9 * seats
        table(m, width, 1.1)
        for i in range(seats):
            x = (i - (seats - 1) / 2) * 0.85
            for turn, y in ((0, -0.8), (180, 0.8)):
                with m.placed(x=x, y=y, turn=turn):
                    chair(m, seat)


def shelf(m, width=1.2, height=2.0, depth=0.35, boards=4, random=None, body="wood"):
    """An open shelf with its back at y = 0 towards a wall and books on most boards; it opens to -y."""
    with m.object("shelf"):
        x, t = width / 2, 0.03
        m.box((-x, -depth, 0), (-x + t, 0, height), body, skip="-z")
        m.box((x - t, -depth, 0), (x, 0, height), body, skip="-z")
        m.box((-x + t, -0.02, 0), (x - t, -0.005, height), body, skip="-x +x -z")
        for i in range(boards + 1):
            z = 0.06 + i * (height - 0.09) / boards
            m.box((-x + t, -depth + 0.01, z), (x - t, -0.02, z + t), body, skip="-x +x +y")
            if random and i < boards:
                books(m, -x + t + 0.02, x - t - 0.02, depth, z + t, (height - 0.09) / boards - t, random)


def books(m, x0, x1, depth, z, room, random):
    """A row of folders between x0 and x1; rows end anywhere, as rows of books do."""
    end = x0 + (x1 - x0) * random.uniform(0.45, 1.0)
    low = z + room * random.uniform(0.6, 0.85)
    m.box((x0, -depth + 0.06, z), (end, -0.03, low), random.choice(("paper", "book", "fabric")), skip="-z")


def cabinet(m, width=1.2, height=1.1, depth=0.45, body="paper"):
    """A closed cupboard with its back at y = 0, a hand's width from the wall."""
    with m.object("cabinet"):
        m.box((-width / 2, -depth, 0), (width / 2, -0.02, height), body, skip="-z")


def bench(m, length=2.4):
    """Five slats on two stone feet; long side along x."""
    with m.object("bench"):
        for side in (-1, 1):
            a, b = sorted((side * (length / 2 - 0.35), side * (length / 2 - 0.6)))
            m.box((a, -0.22, 0), (b, 0.22, 0.4), "stone_dark", skip="-z")
        for i in range(5):
            y = -0.24 + i * 0.1
            m.box((-length / 2, y, 0.42), (length / 2, y + 0.08, 0.46), "wood")


def tree(m, height=3.2, tub=0.6, pot="planter"):
    """A clipped tree in a square tub of half width `tub`: trunk and a crown of four stacked stumps of cones."""
    with m.object("tree"):
        outer, inner, rim, earth = tub, tub - 0.08, 1.15 * tub, 1.15 * tub - 0.08
        m.box((-outer, -outer, 0), (-inner, outer, rim), pot, skip="-z +x")
        m.box((inner, -outer, 0), (outer, outer, rim), pot, skip="-z -x")
        m.box((-inner, -outer, 0), (inner, -inner, rim), pot, skip="-z -x +x +y")
        m.box((-inner, inner, 0), (inner, outer, rim), pot, skip="-z -x +x -y")
        corners = [(-inner, -inner), (inner, -inner), (inner, inner), (-inner, inner)]
        for a, b in zip(corners, corners[1:] + corners[:1]):
            m.upright(b, a, earth, rim, pot)  # the tub's inside, above the earth
        m.floor(-inner, -inner, inner, inner, earth, "soil")
        low = earth + 0.45
        m.frustum(0, 0, earth, low, 0.05, 0.05, 6, "wood")
        crown = height - low
        for i, (t0, t1, r0, r1) in enumerate(((0, 0.2, 0.5, 1.0), (0.2, 0.5, 1.0, 0.86), (0.5, 0.8, 0.86, 0.48),
                                              (0.8, 1, 0.48, 0))):
            r0, r1 = 0.97 * tub * r0, 0.97 * tub * r1
            m.frustum(0, 0, low + t0 * crown, low + t1 * crown, r0, r1, 9, "leaf", bottom=None if i else "leaf")


def materials():
    """What the pieces above are made of."""
    from model import Material
    return {
        "wood": Material((0.46, 0.29, 0.15)),
        "steel": Material((0.34, 0.35, 0.37)),
        "plastic": Material((0.07, 0.07, 0.08)),
        "fabric": Material((0.12, 0.2, 0.36)),
        "fabric_red": Material((0.45, 0.1, 0.07)),
        "paper": Material((0.7, 0.68, 0.62)),
        "book": Material((0.42, 0.2, 0.12)),
        "stone_dark": Material((0.2, 0.19, 0.18)),
        "planter": Material((0.36, 0.2, 0.13)),
        "soil": Material((0.08, 0.06, 0.04)),
        "leaf": Material((0.08, 0.2, 0.06)),
    }
