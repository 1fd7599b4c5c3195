"""grbl-streamer streams, holds, resumes, jogs, cancels and resets."""

import time

from grbl_streamer import GrblStreamer

from desk import CONTROLLER, LONG, check, check_view, end, observe, program, wait_for

events = []
alarms, errors = [], []


def on_event(name, *data):
    events.append(name)
    if name == "on_alarm":
        alarms.append(data)
    elif name == "on_error":
        errors.append(data)


streamer = GrblStreamer(on_event)
streamer.poll_interval = 0.1


def settle():
    """Its view is as old as its last poll; it takes in a few more."""
    time.sleep(0.6)
    return streamer.cmode, list(streamer.cmpos)


def stands():
    wait_for(lambda: streamer.cmode.startswith("Idle"))
    return settle()


def is_under_way(state):
    """Waits for the position, not for a time: a busy machine is late."""
    wait_for(lambda: streamer.cmode == state and streamer.cmpos[0] > 257)


def run(lines):
    streamer.job_new()
    streamer.write(lines)
    events.clear()
    streamer.job_run()


streamer.cnect(CONTROLLER)
check("connect", wait_for(lambda: "on_boot" in events, 5), events)
streamer.poll_start()
# It asks for settings, offsets and modes by itself.
time.sleep(3)
check("it knows the offsets", streamer.settings_hash["G54"][:3] == (0.0, 0.0, 0.0))
check("it knows where it is", streamer.cmode == "Idle", streamer.cmode)

lines = program(20)
run(lines)
finished = wait_for(lambda: "on_job_completed" in events, 60)
# It may say that the job is complete before it says so of the last line.
wait_for(lambda: events.count("on_processed_command") >= 1000, 5)
processed = events.count("on_processed_command")
check("stream 1000 lines", finished and processed == 1000 and not errors, (processed, errors))
check_view("after the program", *stands(), expected=[250.08, 0, 0])

run(LONG)
is_under_way("Run")
streamer.hold()
check("hold", wait_for(lambda: streamer.cmode == "Hold:0" and observe()[0] == "Hold:0"), streamer.cmode)
state, held = settle()
time.sleep(0.5)
check("hold: it stands", list(streamer.cmpos) == held and held[0] > 251, (held, streamer.cmpos))
check_view("in the hold", state, held)
streamer.resume()
wait_for(lambda: streamer.cmode == "Run", 5)
check_view("after the resume", *stands(), expected=[250, 0, 0])

streamer._iface_write("$J=G91 X5 F600\n")
check("jog: it sees it", wait_for(lambda: streamer.cmode == "Jog", 3), streamer.cmode)
check_view("after the jog", *stands(), expected=[255, 0, 0])
streamer._iface_write("$J=G91 X40 F600\n")
is_under_way("Jog")
# It has no jog cancel of its own, and ends jogs with a hold, as Grbl allows.
streamer.hold()
check("jog cancel", wait_for(lambda: streamer.cmode == "Idle", 5), streamer.cmode)
state, position = settle()
check("jog cancel: it ends on its way", 256 < position[0] < 294, position)
check_view("after the jog cancel", state, position)

run(LONG)
is_under_way("Run")
events.clear()
streamer.abort()
check("reset in motion", wait_for(lambda: "on_boot" in events and alarms), (events, alarms))
wait_for(lambda: streamer.cmode == "Alarm", 3)
check_view("after the reset", *settle())
streamer.killalarm()
check("unlock", wait_for(lambda: streamer.cmode == "Idle", 3), streamer.cmode)
events.clear()
streamer.softreset()
check("reset at rest", wait_for(lambda: "on_boot" in events, 5), events)
check_view("at the end", *stands())
check("no line was refused", not errors, errors)
streamer.disconnect()
end()
