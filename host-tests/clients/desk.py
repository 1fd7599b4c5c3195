"""What the clients in Python are checked with: a program, an observer, a list of checks.

The observer is `stillpoint monitor` on the controller's TCP ports: what the controller says of
itself, and what it sends to the drives.
"""

import json
import math
import os
import subprocess
import sys
import time

CONTROLLER = os.environ["CONTROLLER"]
FEED = 600


def program(length_mm):
    """1000 lines from X250 Y0, so many mm along X and back again but for the last two steps."""
    step = length_mm / 499
    there = [f"G1 X{250 + step * n:.3f} F{FEED}" for n in range(500)]
    return ["G90", "G0 X250 Y0"] + there + there[::-1][:498]


LONG = ["G90", f"G1 X300 Y0 F{FEED}", "G1 X300 Y30", "G1 X250 Y0"]


def observe():
    with open(os.environ["PORTS"]) as file:
        ports = json.load(file)
    command = [
        os.environ["STILLPOINT"], "monitor", f"tcp:127.0.0.1:{ports['tcp']}", "--once", "--json",
        "--telemetry", f"tcp:127.0.0.1:{ports['telemetry']}",
    ]
    seen = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    setpoints = seen["setpoints"]
    sent = [setpoints[name] for name in ("x_mm", "y_mm", "z_mm", "c_deg")]
    return seen["state"], seen["machine"], sent


failures = 0


def check(name, holds, detail=""):
    global failures
    if holds:
        print(f"ok {name}", flush=True)
    else:
        failures += 1
        print(f"FAILED {name}: {detail}", flush=True)


def near(one, other, by=0.0011):
    return len(one) > 0 and all(math.isclose(a, b, abs_tol=by) for a, b in zip(one, other))


def check_view(name, state, position, expected=None):
    """The client's view is the controller's, and that is the place where the drives are."""
    seen_state, machine, sent = observe()
    same_state = state.split(":")[0] == seen_state.split(":")[0]
    same_place = near(position, machine) and near(machine, sent)
    as_expected = expected is None or near(position, expected)
    check(
        f"{name}: its view is right",
        same_state and same_place and as_expected,
        f"it sees {state} {position}, the controller says {seen_state} {machine}, "
        f"the drives get {sent}, expected {expected}",
    )


def wait_for(condition, seconds=20):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.02)
    return False


def end():
    sys.exit(1 if failures else 0)
