#!/usr/bin/env python3
"""Error of a picture inside faces, with the noise of its reference removed.

    bench/picture_error.py build/release/lichthof ROOM.obj --size 256x256 -- --samples 1 --elements 4000

The reference is path traced at twice the size, so each pixel of the picture has four of its own. The means A and B of its two diagonals
are nearly the same light with independent noise: mean((x - A)(x - B)) is the mean squared error of x without that noise.
Pixels at edges of faces and of colours, and luminaires, are left out; a smooth picture of 16 samples tells where they are."""
import argparse
import json
import subprocess
import sys
import tempfile


def pixels(path):
    """Rows of RGB of a Radiance picture, run-length coded or plain."""
    data = open(path, "rb").read()
    at = data.index(b"\n\n") + 2
    end = data.index(b"\n", at)
    _, height, _, width = data[at:end].split()
    height, width, at = int(height), int(width), end + 1
    rows = []
    for _ in range(height):
        if data[at:at + 2] == b"\x02\x02" and data[at + 2] * 256 + data[at + 3] == width:
            at += 4
            channels = []
            for _ in range(4):
                run = bytearray()
                while len(run) < width:
                    count = data[at]
                    if count > 128:
                        run += data[at + 1:at + 2] * (count - 128)
                        at += 2
                    else:
                        run += data[at + 1:at + 1 + count]
                        at += 1 + count
                channels.append(run)
            coded = list(zip(*channels))
        else:
            coded = [data[at + 4 * x:at + 4 * x + 4] for x in range(width)]
            at += 4 * width
        rows.append([tuple((c + 0.5) * 2.0 ** (p[3] - 136) if p[3] else 0.0 for c in p[:3]) for p in coded])
    return rows


def is_inside(smooth, x, y, luminaire):
    here = smooth[y][x]
    around = [smooth[y + j][x + i] for j in (-1, 0, 1) for i in (-1, 0, 1)]
    sums = [sum(p) / 3 for p in around]
    if max(sums) > 1.3 * min(sums) or max(sums) > luminaire:
        return False
    return all(abs(a - b) <= 0.25 * max(a, b) for p in (around[1], around[3], around[5], around[7]) for a, b in zip(here, p))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lichthof")
    parser.add_argument("scene")
    parser.add_argument("--size", default="256x256")
    parser.add_argument("--samples", default="64", help="paths per pixel of the reference")
    parser.add_argument("--luminaire", type=float, default=4, help="what shines more (W/m2/sr) is left out")
    end = (sys.argv + ["--"]).index("--")  # what follows are options of `lichthof render`
    given, options = parser.parse_args(sys.argv[1:end]), sys.argv[end + 1:]
    width, height = map(int, given.size.split("x"))
    with tempfile.TemporaryDirectory() as folder:
        def render(name, size, options):
            path = f"{folder}/{name}.hdr"
            done = subprocess.run([given.lichthof, "render", given.scene, "-o", path, "--size", size, "--json", "--threads", "1"] + options,
                                  capture_output=True, text=True, check=True)
            return pixels(path), json.loads(done.stdout)["seconds"]
        picture, seconds = render("picture", given.size, options)
        smooth, _ = render("smooth", given.size, ["--samples", "16"])
        reference, _ = render("reference", f"{2 * width}x{2 * height}", ["--method", "reference", "--samples", given.samples])
    count = error = whole = bias = 0
    for y in range(1, height - 1):
        for x in range(1, width - 1):
            if not is_inside(smooth, x, y, given.luminaire):
                continue
            count += 1
            for c in range(3):
                a = (reference[2 * y][2 * x][c] + reference[2 * y + 1][2 * x + 1][c]) / 2
                b = (reference[2 * y][2 * x + 1][c] + reference[2 * y + 1][2 * x][c]) / 2
                error += (picture[y][x][c] - a) * (picture[y][x][c] - b)
                bias += picture[y][x][c] - (a + b) / 2
                whole += (a + b) / 2
    print(f"{count} of {width * height} pixels: NRMSE {max(error, 0) ** 0.5 * (3 * count) ** 0.5 / whole:.4f}, "
          f"bias {bias / whole:+.4f}; first pass {seconds['radiosity']:.2f} s, rays {seconds['rays']:.2f} s on one thread")


if __name__ == "__main__":
    main()
