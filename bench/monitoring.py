#!/usr/bin/env python3
"""What watching a lab costs: CPU seconds of a job that nobody watches, that `lichthof top` watches, and that twenty viewers of
the dashboard watch beside it, one of them stalled.

    bench/monitoring.py build/release/lichthof scenes/two_rooms.toml --rounds 5 -- --elements 60000 --eps 1e-6

A controller and two nodes are started once; each round has one run of each kind, in turn. Monitoring works in the controller
and in `top`: their seconds beside those of the same job unwatched, as a share of all that the lab computed, are the cost.
Viewers read on threads of this script and are not counted, as a browser would not be.
"""
import argparse
import json
import os
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

from lab import Lab, cpu_s, resident_mib

VIEWERS = 20  # one of them never reads
KINDS = ("unwatched", "top", "viewers")
GOALS = {"top": 2.0, "viewers": 3.0}


class Viewer(threading.Thread):
    """A dashboard: reads events, and the picture every other second as the page does. Stalled: asks, and never reads."""

    picture = ""

    def __init__(self, port, stalled):
        super().__init__(daemon=True)
        self.port, self.stalled, self.over = port, stalled, False
        self.bytes = 0
        self.start()

    def ask(self, path, buffer=None):
        stream = socket.socket()
        if buffer:
            stream.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
        stream.connect(("127.0.0.1", self.port))
        stream.settimeout(1)
        stream.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        return stream

    def read(self, stream):
        try:
            piece = stream.recv(65536)
        except TimeoutError:
            return True
        self.bytes += len(piece)
        return bool(piece)

    def run(self):
        events = self.ask("/v1/events", 4096 if self.stalled else None)
        pictured = time.monotonic()
        while not self.over:
            if self.stalled:
                time.sleep(0.2)
                continue
            if not self.read(events):
                events = self.ask("/v1/events")
            if time.monotonic() - pictured > 2 and self.picture:
                pictured = time.monotonic()
                with self.ask(self.picture) as stream:
                    while self.read(stream):
                        pass
        events.close()


def run_job(lab, scene, options, kind):
    top, viewers = None, []
    if kind != "unwatched":
        top = lab.start(["top", "--cluster", f"127.0.0.1:{lab.people}", "--json", "--count", "100000"], subprocess.DEVNULL)
    if kind == "viewers":
        viewers = [Viewer(lab.people, stalled=i == 0) for i in range(VIEWERS)]
    time.sleep(2)  # loading a program is no part of watching
    before, top_before = lab.seconds(), cpu_s(top.pid) if top else 0
    began = time.monotonic()
    job = lab.asked("submit", scene, *options)["id"]
    for viewer in viewers:
        viewer.picture = f"/v1/jobs/{job}/picture.png"
    subprocess.run([lab.program, "jobs", "watch", str(job), "--cluster", f"127.0.0.1:{lab.people}", "--quiet"], check=True)
    after, top_s = lab.seconds(), cpu_s(top.pid) - top_before if top else 0
    wall_s = time.monotonic() - began
    for viewer in viewers:
        viewer.over = True
    for viewer in viewers:
        viewer.join()
    if top:
        top.send_signal(signal.SIGTERM)
        top.wait()
    return {"controller_s": after[0] - before[0], "nodes_s": after[1] - before[1], "top_s": top_s, "wall_s": wall_s,
            "controller_mib": resident_mib(lab.controller.pid), "viewers_mb": sum(viewer.bytes for viewer in viewers) / 1e6}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("scene")
    parser.add_argument("--rounds", type=int, default=5, help="and behind -- the options of lichthof submit")
    words = sys.argv[1:]
    at = words.index("--") if "--" in words else len(words)
    asked = parser.parse_args(words[:at])
    asked.options = words[at + 1:]
    runs = {kind: [] for kind in KINDS}
    with tempfile.TemporaryDirectory() as folder:
        lab = Lab(asked.program, folder)
        try:
            run_job(lab, asked.scene, asked.options, "unwatched")  # warms up
            for i in range(asked.rounds):
                for kind in KINDS[i % 3:] + KINDS[:i % 3]:
                    runs[kind].append(run_job(lab, asked.scene, asked.options, kind))
                    print(f"round {i + 1} {kind}: " + ", ".join(f"{k} {v:.2f}" for k, v in runs[kind][-1].items()),
                          file=sys.stderr)
        finally:
            lab.stop()

    def median(kind, figure):
        return statistics.median(figure(run) for run in runs[kind])

    def watching_s(run):
        return run["controller_s"] + run["top_s"]

    lab_s = median("unwatched", lambda run: run["controller_s"] + run["nodes_s"])
    print(f"unwatched: {lab_s:.2f} CPU s of controller and nodes, controller {median('unwatched', watching_s):.2f}")
    for kind in KINDS[1:]:
        paired = statistics.median(watching_s(a) - watching_s(b) for a, b in zip(runs[kind], runs["unwatched"]))
        whole = statistics.median((watching_s(a) + a["nodes_s"]) / (watching_s(b) + b["nodes_s"]) - 1
                                  for a, b in zip(runs[kind], runs["unwatched"]))
        print(f"{kind}: {paired:+.3f} CPU s, {100 * paired / lab_s:.2f} % of the lab's (goal {GOALS[kind]} %); "
              f"all processes {100 * whole:+.2f} %; controller {max(run['controller_mib'] for run in runs[kind]):.0f} MiB at most")


if __name__ == "__main__":
    main()
