"""Parts of rooms: lining, windows, doors, lamps. Walls run along x, the way into the room is +y (see Model.wall)."""

LINTEL = 0.2  # how far the night stands behind an outer wall's inside


def window(m, hole, mullions, transom=None, glazed=False):
    """A frame in a hole of the front: its ring, upright bars and one cross bar. Seen from both sides."""
    x0, x1, z0, z1 = hole
    w, y0, y1 = 0.06, 0.06, 0.13
    inner = (x0 + w, x1 - w, z0 + w, z1 - w)
    outside = [(x0, z0), (x1, z0), (x1, z1), (x0, z1)]
    inside = [(inner[0], inner[2]), (inner[1], inner[2]), (inner[1], inner[3]), (inner[0], inner[3])]
    with m.object("window"):
        for i in range(4):
            (ax, az), (bx, bz), (cx, cz), (dx, dz) = outside[i], outside[i - 3], inside[i - 3], inside[i]
            m.face([(ax, y0, az), (bx, y0, bz), (cx, y0, cz), (dx, y0, dz)], "frame")
            m.face([(dx, y1, dz), (cx, y1, cz), (bx, y1, bz), (ax, y1, az)], "frame")
            m.face([(dx, y0, dz), (cx, y0, cz), (cx, y1, cz), (dx, y1, dz)], "frame")
        xs = [inner[0] + (inner[1] - inner[0]) * (i + 1) / (mullions + 1) for i in range(mullions)]
        for x in xs:
            m.box((x - 0.025, y0 + 0.01, inner[2]), (x + 0.025, y1 - 0.01, inner[3]), "frame", skip="-z +z")
        if transom:
            m.box((inner[0], y0 + 0.02, transom - 0.03), (inner[1], y1 - 0.02, transom + 0.03), "frame", skip="-x +x")
        if glazed:
            y = (y0 + y1) / 2
            m.upright((inner[0], y), (inner[1], y), inner[2], inner[3], "glass")


def door(m, hole, ajar, y=0.08):
    """A leaf in its frameless opening, hinged on the left and standing `ajar` degrees into the room."""
    x0, x1, _, z1 = hole
    with m.object("door"), m.placed(x=x0 + 0.01, y=y, turn=ajar):
        m.box((0, 0, 0.01), (x1 - x0 - 0.02, 0.05, z1 - 0.01), "door")


def shell(m, x0, x1, y0, y1, height, floor, window=1.6, every=3.0, tile=None, wall="wall"):
    """Lines a room from the inside: floor, ceiling, both side walls and the outer wall at y1 with a window for about
    `every` metres. The wall at y0, towards gallery or corridor, is the caller's. Black panes stand for the night."""
    m.floor(x0, y0, x1, y1, 0, floor, tile)
    m.ceiling(x0, y0, x1, y1, height, "soffit")
    m.upright((x0, y0), (x0, y1), 0, height, wall)
    m.upright((x1, y1), (x1, y0), 0, height, wall)
    count = max(1, int((x1 - x0) / every))
    width = (x1 - x0) / count
    middles = [x0 + (i + 0.5) * width for i in range(count)]
    holes = [(x - window / 2, x + window / 2, 0.8, min(2.5, height - 0.3)) for x in middles] if window else []
    m.sheet(x0, x1, 0, height, y1, wall, holes)
    for hole in holes:
        m.reveals(hole, y1, y1 + LINTEL, wall)
        m.sheet(*hole, y1 + LINTEL, "night")


def hanging_lamp(m, x, y, ceiling, length=3.0, width=0.4, drop=0.5, light="lamp_room"):
    """A long luminaire on two rods; only its lower face shines."""
    with m.object("lamp"):
        lo, hi = (x - length / 2, y - width / 2, ceiling - drop), (x + length / 2, y + width / 2, ceiling - drop + 0.1)
        m.box(lo, hi, "shade", skip="-z")
        m.ceiling(lo[0], lo[1], hi[0], hi[1], lo[2], light)
        for side in (-0.4, 0.4):
            rod = x + side * length
            m.box((rod - 0.01, y - 0.01, hi[2]), (rod + 0.01, y + 0.01, ceiling), "shade", skip="-z +z")


def materials():
    """What the parts above are made of; the luminaires' light is each scene's own."""
    from model import Material
    return {
        "wall": Material((0.76, 0.75, 0.71)),
        "soffit": Material((0.78, 0.76, 0.7)),
        "frame": Material((0.1, 0.2, 0.17)),
        "door": Material((0.33, 0.15, 0.08)),
        "night": Material((0.03, 0.04, 0.06)),  # keeps the light inside: panes with the night behind them
        "glass": Material((0, 0, 0), ks=(1, 1, 1), illum=4, ni=1.52),
        "shade": Material((0.16, 0.15, 0.13)),
        "carpet": Material((0.24, 0.27, 0.32)),
    }
