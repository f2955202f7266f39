"""A lab on this machine, for measurements: a controller and nodes as processes."""
import json
import os
import pathlib
import signal
import subprocess
import time


def cpu_s(pid):
    """User and system time of a process so far."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident_mib(pid):
    status = pathlib.Path(f"/proc/{pid}/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0]) / 1024


class Lab:
    def __init__(self, program, folder, names=("anna", "bert"), checkpoint_s=3600):
        self.program = program
        self.controller = self.start(["controller", "--port", "0", "--node-port", "0", "--state", folder + "/state",
                                      "--checkpoint", str(checkpoint_s), "--json"], subprocess.PIPE)
        ports = json.loads(self.controller.stdout.readline())
        self.people = ports["people"]
        self.nodes = [self.start(["node", "--join", f"127.0.0.1:{ports['nodes']}", "--name", name, "--threads", "1",
                                  "--cache", folder + "/cache"], subprocess.DEVNULL) for name in names]
        while len(self.asked("shell", "-c", "nodes")["nodes"]) < len(self.nodes):
            time.sleep(0.1)

    def start(self, words, stdout):
        return subprocess.Popen([self.program, *words], stdout=stdout, stderr=subprocess.DEVNULL)

    def asked(self, *words):
        answer = subprocess.run([self.program, *words, "--cluster", f"127.0.0.1:{self.people}", "--json"],
                                stdout=subprocess.PIPE, check=True)
        return json.loads(answer.stdout)

    def seconds(self):
        """Of the controller, and of all nodes."""
        return cpu_s(self.controller.pid), sum(cpu_s(node.pid) for node in self.nodes)

    def stop(self):
        for process in [*self.nodes, self.controller]:
            process.send_signal(signal.SIGTERM)
        for process in [*self.nodes, self.controller]:
            process.wait()
