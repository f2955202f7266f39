"""Writes scenes as Wavefront OBJ + MTL + scene TOML; the shared kit of the generators in this folder.

Conventions of every scene here:
- metres, z up, polygons counter-clockwise seen from their front;
- vertices are shared: two corners closer than 0.1 mm are one vertex, so neighbours meet without cracks;
- a face that lies flat on another (the foot of a wall, the end of a rail) is left out instead of being hidden: a hidden
  face still costs patches, and a patch half in the dark smears light under the wall.
"""

import math
import struct
import sys
import zlib
from contextlib import contextmanager
from pathlib import Path

GRID = 4  # decimals kept: 0.1 mm


class Material:
    """Diffuse unless told otherwise. `ke` is the emitted radiance in W/(m² sr), out of the front only."""

    def __init__(self, kd, ke=None, ks=None, ns=None, illum=1, ni=None, map_kd=None):
        self.kd, self.ke, self.ks, self.ns, self.illum, self.ni, self.map_kd = kd, ke, ks, ns, illum, ni, map_kd

    def lines(self):
        rgb = lambda key, values: f"{key} " + " ".join(f"{v:g}" for v in values)
        yield rgb("Kd", self.kd)
        yield rgb("Ks", self.ks or (0, 0, 0))
        if self.ns:
            yield f"Ns {self.ns:g}"
        if self.ke:
            yield rgb("Ke", self.ke)
        if self.ni:
            yield f"Ni {self.ni:g}"
        if self.map_kd:
            yield f"map_Kd {self.map_kd}"
        yield f"illum {self.illum}"


class Model:
    """Faces in the order they are added, grouped by object. Coordinates pass through the current placement."""

    def __init__(self, materials):
        self.materials = materials
        self.vertices, self._index = [], {}
        self.uvs, self._uv_index = [], {}
        self.faces = []  # (object name, material name, vertex indices, uv indices or None)
        self.name = "scene"
        self._frame = (1.0, 0.0, 0.0, 0.0, 0.0)  # cos, sin, translation

    # --- placement -------------------------------------------------------------------------------------------------

    @contextmanager
    def placed(self, x=0.0, y=0.0, z=0.0, turn=0.0):
        """Everything added inside is turned about z by `turn` degrees, then moved; placements nest."""
        outer = self._frame
        c, s, tx, ty, tz = outer
        # Quarter turns are exact, so that the four sides of a building meet in the same vertices.
        quarter = {0: (1, 0), 90: (0, 1), 180: (-1, 0), 270: (0, -1)}
        c2, s2 = quarter.get(turn % 360) or (math.cos(math.radians(turn)), math.sin(math.radians(turn)))
        self._frame = (c * c2 - s * s2, s * c2 + c * s2, tx + c * x - s * y, ty + s * x + c * y, tz + z)
        try:
            yield self
        finally:
            self._frame = outer

    @contextmanager
    def object(self, name):
        """Names the faces added inside; nested names join with a dot."""
        outer = self.name
        self.name = name if outer == "scene" else f"{outer}.{name}"
        try:
            yield self
        finally:
            self.name = outer

    # --- faces -----------------------------------------------------------------------------------------------------

    def _vertex(self, p):
        c, s, tx, ty, tz = self._frame
        # `+ 0.0` turns a rounded -0.0 into 0.0.
        key = tuple(round(v, GRID) + 0.0 for v in (c * p[0] - s * p[1] + tx, s * p[0] + c * p[1] + ty, p[2] + tz))
        if key not in self._index:
            self.vertices.append(key)
            self._index[key] = len(self.vertices)
        return self._index[key]

    def _uv(self, uv):
        key = tuple(round(v, GRID) + 0.0 for v in uv)
        if key not in self._uv_index:
            self.uvs.append(key)
            self._uv_index[key] = len(self.uvs)
        return self._uv_index[key]

    def face(self, points, material, uvs=None):
        """A convex polygon, counter-clockwise seen from its front."""
        assert material in self.materials, material
        texture = [self._uv(uv) for uv in uvs] if uvs else None
        self.faces.append((self.name, material, [self._vertex(p) for p in points], texture))

    def floor(self, x0, y0, x1, y1, z, material, tile=None):
        """A horizontal rectangle that faces up; `tile` metres of floor carry one repeat of the texture."""
        points = [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]
        self.face(points, material, [(p[0] / tile, p[1] / tile) for p in points] if tile else None)

    def ceiling(self, x0, y0, x1, y1, z, material):
        """A horizontal rectangle that faces down."""
        self.face([(x0, y0, z), (x0, y1, z), (x1, y1, z), (x1, y0, z)], material)

    def upright(self, a, b, z0, z1, material):
        """A vertical rectangle above the line a-b; its front is on the right of the walk from a to b."""
        self.face([(*a, z0), (*b, z0), (*b, z1), (*a, z1)], material)

    # --- solids ----------------------------------------------------------------------------------------------------

    def box(self, lo, hi, material, skip=""):
        """An upright box; `skip` names sides that touch something: any of "-x +x -y +y -z +z"."""
        (x0, y0, z0), (x1, y1, z1) = lo, hi
        sides = {
            "-x": [(x0, y1, z0), (x0, y0, z0), (x0, y0, z1), (x0, y1, z1)],
            "+x": [(x1, y0, z0), (x1, y1, z0), (x1, y1, z1), (x1, y0, z1)],
            "-y": [(x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)],
            "+y": [(x1, y1, z0), (x0, y1, z0), (x0, y1, z1), (x1, y1, z1)],
            "-z": [(x0, y0, z0), (x0, y1, z0), (x1, y1, z0), (x1, y0, z0)],
            "+z": [(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)],
        }
        for side, points in sides.items():
            if side not in skip.split():
                self.face(points, material)

    def beam(self, p, q, width, height, material, ends=True):
        """A bar from p to q, its top face's middle on the line p-q; works for slopes, its sides stay vertical."""
        dx, dy = q[0] - p[0], q[1] - p[1]
        run = math.hypot(dx, dy)
        nx, ny = -dy / run * width / 2, dx / run * width / 2  # to the left of the walk from p to q
        corner = lambda e, side, down: (e[0] + side * nx, e[1] + side * ny, e[2] - down)
        pl, pr, ql, qr = (corner(e, side, 0) for e in (p, q) for side in (1, -1))
        pl_, pr_, ql_, qr_ = (corner(e, side, height) for e in (p, q) for side in (1, -1))
        for quad in ([pr, qr, ql, pl], [pl_, ql_, qr_, pr_], [pr_, qr_, qr, pr], [ql_, pl_, pl, ql]):
            self.face(quad, material)
        if ends:
            self.face([pl_, pr_, pr, pl], material)
            self.face([qr_, ql_, ql, qr], material)

    def frustum(self, x, y, z0, z1, r0, r1, sides, material, bottom=None, top=None):
        """A round thing with flat sides around a vertical axis; caps only where a material is given."""
        angle = lambda i: 2 * math.pi * (i + 0.5) / sides
        ring = lambda r, z: [(x + r * math.cos(angle(i)), y + r * math.sin(angle(i)), z) for i in range(sides)]
        low, high = ring(max(r0, 1e-9), z0), ring(max(r1, 1e-9), z1)
        for i in range(sides):
            j = (i + 1) % sides
            if r1 <= 0:
                self.face([low[i], low[j], (x, y, z1)], material)
            elif r0 <= 0:
                self.face([(x, y, z0), high[j], high[i]], material)
            else:
                self.face([low[i], low[j], high[j], high[i]], material)
        if bottom:
            self.face(low[::-1], bottom)
        if top:
            self.face(high, top)

    # --- walls -----------------------------------------------------------------------------------------------------

    def sheet(self, x0, x1, z0, z1, y, material, holes=(), back=False):
        """A vertical rectangle in the plane y with rectangular holes (x0, x1, z0, z1); faces -y, or +y for `back`.

        It is cut along all edges of all holes, so its pieces share whole edges: no T-vertices inside a wall.
        """
        inside = [(max(a, x0), min(b, x1), max(c, z0), min(d, z1)) for a, b, c, d in holes if a < x1 and b > x0]
        xs = sorted({x0, x1, *(h[0] for h in inside), *(h[1] for h in inside)})
        zs = sorted({z0, z1, *(h[2] for h in inside), *(h[3] for h in inside)})
        for a, b in zip(xs, xs[1:]):
            for c, d in zip(zs, zs[1:]):
                if any(h[0] <= a and b <= h[1] and h[2] <= c and d <= h[3] for h in inside):
                    continue
                quad = [(a, y, c), (b, y, c), (b, y, d), (a, y, d)]
                self.face(quad[::-1] if back else quad, material)

    def reveals(self, hole, y0, y1, material, threshold=None):
        """The four inner faces of a hole through a wall between the planes y0 < y1; `threshold` is the floor's one."""
        a, b, c, d = hole
        self.face([(a, y0, c), (a, y0, d), (a, y1, d), (a, y1, c)][::-1], material)
        self.face([(b, y0, c), (b, y0, d), (b, y1, d), (b, y1, c)], material)
        self.ceiling(a, y0, b, y1, d, material)
        self.floor(a, y0, b, y1, c, threshold or material)

    def wall(self, front_span, back_span, height, thickness, front, back, holes=(), threshold=None):
        """A wall along x with its front in the plane y = 0 facing -y. It stands between two slabs, so it has no top and
        no foot. Front and back span what crossing walls leave free. `threshold` paves holes that reach the floor."""
        self.sheet(*front_span, 0, height, 0, front, holes)
        self.sheet(*back_span, 0, height, thickness, back, holes, back=True)
        for hole in holes:
            self.reveals(hole, 0, thickness, front, threshold if hole[2] == 0 else None)

    # --- output ----------------------------------------------------------------------------------------------------

    def write(self, folder, stem):
        """Writes STEM.obj and STEM.mtl into the folder."""
        used = {face[1] for face in self.faces}
        mtl = []
        for name, material in self.materials.items():
            if name in used:
                mtl += [f"newmtl {name}", *material.lines(), ""]
        number = lambda v: f"{v:.{GRID}f}".rstrip("0").rstrip(".")
        obj = [f"mtllib {stem}.mtl"]
        obj += ["v " + " ".join(map(number, v)) for v in self.vertices]
        obj += ["vt " + " ".join(map(number, uv)) for uv in self.uvs]
        name = material = None
        for face_name, face_material, corners, texture in self.faces:
            if face_name != name:
                name = face_name
                obj.append(f"o {name}")
            if face_material != material:
                material = face_material
                obj.append(f"usemtl {material}")
            refs = [f"{v}/{t}" for v, t in zip(corners, texture)] if texture else map(str, corners)
            obj.append("f " + " ".join(refs))
        Path(folder).mkdir(parents=True, exist_ok=True)
        Path(folder, f"{stem}.mtl").write_text("\n".join(mtl).rstrip() + "\n", encoding="utf-8")
        Path(folder, f"{stem}.obj").write_text("\n".join(obj) + "\n", encoding="utf-8")

    def summary(self):
        """One line: faces, area, luminaires and faults; generators print it."""
        area = sum(self._area(face) for face in self.faces)
        lamps = [face for face in self.faces if self.materials[face[1]].ke]
        return (f"{len(self.faces)} faces, {len(self.vertices)} vertices, {area:.1f} m2, {len(lamps)} luminaires, "
                f"{len(self.faults())} faults")

    def faults(self, flat=2e-4):
        """Faces no mesher should have to face: no area, listed twice, or bent by more than `flat` metres."""
        found, seen = [], set()
        for face in self.faces:
            normal = self._normal(face)
            length = math.hypot(*normal)
            if len(set(face[2])) < len(face[2]) or length / 2 < 1e-7:
                found.append(("no area", face))
                continue
            key = tuple(sorted(face[2]))
            if key in seen:
                found.append(("twice", face))
            seen.add(key)
            unit = [n / length for n in normal]
            first = self.vertices[face[2][0] - 1]
            if any(abs(sum(u * (a - b) for u, a, b in zip(unit, self.vertices[i - 1], first))) > flat for i in face[2]):
                found.append(("bent", face))
        return found

    def _normal(self, face):
        points = [self.vertices[i - 1] for i in face[2]]
        total = [0.0, 0.0, 0.0]
        for (ax, ay, az), (bx, by, bz) in zip(points, points[1:] + points[:1]):  # Newell
            total[0] += (ay - by) * (az + bz)
            total[1] += (az - bz) * (ax + bx)
            total[2] += (ax - bx) * (ay + by)
        return total

    def _area(self, face):
        return math.hypot(*self._normal(face)) / 2


def write_scene(folder, stem, patch, cameras, note="", element=None):
    """Writes STEM.toml: one part, the patch size in metres and cameras (name, eye, target, vertical fov in degrees)."""
    vector = lambda v: "[" + ", ".join(f"{c:g}" for c in v) + "]"
    lines = [f"# {note}"] if note else []
    lines += ['unit = "m"', 'up = "z"', "", "[mesh]", f"patch = {patch:g}"]
    lines += [f"element = {element:g}"] if element else []
    lines += ["", "[[part]]", f'file = "{stem}.obj"']
    for name, eye, target, fov in cameras:
        lines += ["", "[[camera]]", f'name = "{name}"', f"eye = {vector(eye)}", f"target = {vector(target)}",
                  "up = [0, 0, 1]", f"fov = {fov:g}"]
    Path(folder, f"{stem}.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")


def main(usage, stem, build, patch, cameras, note="", element=None):
    """What a generator does when it is run: writes the model that `build` makes, and its scene, into the folder that is the
    only argument; says what it wrote. Returns the folder."""
    if len(sys.argv) != 2:
        sys.exit(usage)
    folder, model = sys.argv[1], build()
    model.write(folder, stem)
    write_scene(folder, stem, patch, cameras, note, element)
    print(f"{stem}:", model.summary())
    return folder


def write_png(path, width, height, pixel):
    """Writes an 8-bit RGB image; pixel(x, y) gives three values in 0..255, y = 0 at the top."""
    rows = b"".join(b"\0" + bytes(c for x in range(width) for c in pixel(x, y)) for y in range(height))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    Path(path).write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9))
                           + chunk(b"IEND", b""))
