#!/usr/bin/env python3
"""What a cluster costs: CPU seconds of a job on three nodes and their controller, against `lichthof render` of the same cells.

    bench/cluster_cost.py build/release/lichthof scenes/office_floor.toml --rounds 3 -- --cells 2x2 --size 640x480

Each round renders in one process, starts a lab, runs the job twice and stops the lab. The first job has everything that a lab
needs from nothing: start-up of its processes, the scene on its way, meshes and trees on every node. The second finds the scene
on the nodes. Checkpoints are as users have them, unless --checkpoint says otherwise.
"""
import argparse
import resource
import statistics
import subprocess
import sys
import tempfile

from lab import Lab

NODES = ("anna", "bert", "carl")
GOAL = 1.15


def children_s():
    """User and system time of all processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def alone_s(program, scene, options, folder):
    before = children_s()
    subprocess.run([program, "render", scene, "-o", folder + "/alone.exr", "--quiet", *options], check=True)
    return children_s() - before


def lab_s(program, scene, options, folder, checkpoint_s):
    lab = Lab(program, folder, NODES, checkpoint_s)
    seconds, before = [], 0
    try:
        for _ in range(2):
            submitted = subprocess.run([program, "submit", scene, "--cluster", f"127.0.0.1:{lab.people}", "-o",
                                        folder + "/lab.exr", "--quiet", *options])
            submitted.check_returncode()
            now = sum(lab.seconds())
            seconds.append(now - before)
            before = now
    finally:
        lab.stop()
    return seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("scene")
    parser.add_argument("--rounds", type=int, default=3, help="and behind -- the options of lichthof render")
    parser.add_argument("--checkpoint", type=float, default=5, help="seconds")
    words = sys.argv[1:]
    at = words.index("--") if "--" in words else len(words)
    asked = parser.parse_args(words[:at])
    ratios = []
    for i in range(asked.rounds):
        with tempfile.TemporaryDirectory() as folder:
            alone = alone_s(asked.program, asked.scene, words[at + 1:], folder)
            first, second = lab_s(asked.program, asked.scene, words[at + 1:], folder, asked.checkpoint)
        ratios.append((first / alone, second / alone))
        print(f"round {i + 1}: one process {alone:.2f} CPU s, lab {first:.2f}, then {second:.2f}", file=sys.stderr)
    for name, each in zip(("first job", "second job"), zip(*ratios)):
        print(f"{name}: {statistics.median(each):.3f} of one process (goal {GOAL})")


if __name__ == "__main__":
    main()
