"""pygrbl-streamer streams, holds, resumes, jogs, cancels and resets."""

import threading
import time

from pygrbl_streamer import GrblStreamer, State

from desk import CONTROLLER, LONG, check, check_view, end, observe, program, wait_for

streamer = GrblStreamer(CONTROLLER)
errors, alarms, banners = [], [], []
streamer.error_callback = errors.append
streamer.alarm_callback = alarms.append
streamer.receive_callback = lambda line: line.startswith("Grbl") and banners.append(line)


def view():
    """What it knows of the controller after a fresh report."""
    asked = time.time()
    streamer.realtime(b"?")
    wait_for(lambda: streamer.last_status.get("time", 0) >= asked)
    raw = streamer.last_status["raw"]
    position = raw.split("|")[1].removeprefix("MPos:").split(",")
    return streamer.last_status["state"], [float(value) for value in position]


def is_under_way():
    """Waits for the position, not for a time: a busy machine is late."""

    def moves():
        state, position = view()
        return state in ("Run", "Jog") and position[0] > 257

    wait_for(moves)


streamer.connect()
check("connect", streamer.state == State.IDLE and banners, streamer.state)

lines = program(20)
check("stream 1000 lines", len(lines) == 1000 and streamer.stream(lines, total=1000), errors)
check_view("after the program", *view(), expected=[250.08, 0, 0, 0])

result = []
job = threading.Thread(target=lambda: result.append(streamer.stream(LONG, total=len(LONG))))
job.start()
is_under_way()
streamer.pause()
check("hold", wait_for(lambda: view()[0] == "Hold" and observe()[0] == "Hold:0"), view())
state, held = view()
time.sleep(0.5)
check("hold: it stands", view()[1] == held and held[0] > 251, (held, view()))
check_view("in the hold", state, held)
streamer.resume()
job.join(60)
check("resume", result == [True], result)
check_view("after the resume", *view(), expected=[250, 0, 0, 0])

check("jog", streamer.command("$J=G91 X5 F600"))
check("jog: it sees it", view()[0] == "Jog", view())
wait_for(lambda: view()[0] == "Idle")
check_view("after the jog", *view(), expected=[255, 0, 0, 0])
streamer.command("$J=G91 X40 F600")
is_under_way()
streamer.realtime(b"\x85")
check("jog cancel", wait_for(lambda: view()[0] == "Idle", 5), view())
state, position = view()
check("jog cancel: it ends on its way", 256 < position[0] < 294, position)
check_view("after the jog cancel", state, position)

job = threading.Thread(target=lambda: result.append(streamer.stream(LONG, total=len(LONG))))
job.start()
is_under_way()
streamer.stop()
job.join(10)
check("reset in motion", wait_for(lambda: "ALARM:3" in alarms), alarms)
check("reset in motion: the program has ended", result == [True, False], result)
check_view("after the reset", *view())
check("unlock", streamer.unlock() and view()[0] == "Idle", view())
check("reset at rest", streamer.reset() and streamer.state == State.IDLE, streamer.state)
check_view("at the end", *view())
streamer.disconnect()
# The alarm's own error:9 for what was still under way is no error of the stream.
check("no line was refused", all(error == "error:9" for error in errors), errors[:5])
end()
