//! Every command, realtime byte, error and alarm of the dialect, a row each.
//!
//! The rows are the table in `host-tests/dialect.md`, too: `UPDATE_TABLES=1 cargo test
//! --release --test protocol dialect` writes it anew.

use std::fmt::Write;
use std::path::Path;

use crate::homing::bench_arm;
use crate::identification::plant;
use host_tests::serial_loop::{Records, SerialLoop, with_controller};
use planner_core::protocol::{Alarm, ERRORS};

/// What is sent, and what has to be heard.
struct Row {
    /// Command, error or alarm, as the table calls it.
    what: &'static str,
    /// What it does here.
    meaning: &'static str,
    /// Sent one after the other, each being waited for. `@…` is a test's own: see [`send`].
    given: &'static [&'static str],
    /// The last of them, which is judged.
    then: &'static str,
    /// Parts of the answer, in this order.
    heard: &'static [&'static str],
}

const fn row(
    what: &'static str,
    meaning: &'static str,
    given: &'static [&'static str],
    then: &'static str,
    heard: &'static [&'static str],
) -> Row {
    Row {
        what,
        meaning,
        given,
        then,
        heard,
    }
}

/// The first point: where the robot is.
const AT: &str = "G0 X200 Y0";
const NONE: &[&str] = &[];
const THERE: &[&str] = &[AT];

const COMMANDS: &[Row] = &[
    row(
        "G0",
        "rapid move",
        THERE,
        "G0 X210 @stop",
        &["ok", "MPos:210.000,0.000"],
    ),
    row(
        "G1",
        "move at the feedrate",
        THERE,
        "G1 X210 F3000 @stop",
        &["ok", "MPos:210.000,0.000"],
    ),
    row(
        "G2",
        "clockwise arc",
        THERE,
        "G2 X220 Y0 I10 J0 F3000 @stop",
        &["ok", "MPos:220.000,0.000"],
    ),
    row(
        "G3",
        "counter-clockwise arc",
        THERE,
        "G3 X220 Y0 R10 F3000 @stop",
        &["ok", "MPos:220.000,0.000"],
    ),
    row("G4", "dwell", THERE, "G4 P0.1", &["ok"]),
    row(
        "G10 L2",
        "sets a work offset",
        THERE,
        "G10 L2 P1 X100",
        &["ok"],
    ),
    row(
        "G10 L20",
        "sets a work offset so that the tool is at the given point",
        &[AT, "G10 L20 P2 X0 Y0"],
        "$#",
        &["[G55:200.000,0.000,", "ok"],
    ),
    row("G17", "plane XY", NONE, "G17", &["ok"]),
    row("G18", "plane ZX", &["G18"], "$G", &["G18", "ok"]),
    row("G19", "plane YZ", &["G19"], "$G", &["G19", "ok"]),
    row(
        "G20",
        "inches",
        &[AT, "G20"],
        "G0 X8 @stop",
        &["ok", "MPos:203.200"],
    ),
    row("G21", "millimetres", &["G20", "G21"], "$G", &["G21", "ok"]),
    row(
        "G28",
        "to the stored position, through a point",
        &[AT, "G28.1", "G0 X220 Y10"],
        "G28 X210 @stop",
        &["ok", "MPos:200.000,10.000"],
    ),
    row(
        "G28.1",
        "stores the position",
        &[AT, "G28.1"],
        "$#",
        &["[G28:200.000,0.000,0.000", "ok"],
    ),
    row(
        "G30",
        "to the other stored position",
        &[AT, "G30.1", "G0 X220"],
        "G30 @stop",
        &["ok", "MPos:200.000,0.000"],
    ),
    row(
        "G30.1",
        "stores the other position",
        &[AT, "G30.1"],
        "$#",
        &["[G30:200.000,0.000,0.000", "ok"],
    ),
    row("G40", "no cutter compensation", NONE, "G40", &["ok"]),
    row(
        "G43.1",
        "tool length",
        &[AT, "G43.1 Z5"],
        "$#",
        &["[TLO:5.000", "ok"],
    ),
    row(
        "G49",
        "no tool length",
        &[AT, "G43.1 Z5", "G49"],
        "$#",
        &["[TLO:0.000", "ok"],
    ),
    row(
        "G53",
        "one move in machine coordinates",
        &[AT, "G10 L2 P1 X100"],
        "G53 G0 X210 @stop",
        &["ok", "MPos:210.000"],
    ),
    row(
        "G54",
        "work offset 1",
        &[AT, "G10 L2 P1 X100", "G54"],
        "G0 X110 @stop",
        &["ok", "MPos:210.000"],
    ),
    row(
        "G55",
        "work offset 2",
        &[AT, "G10 L2 P2 X90", "G55"],
        "G0 X110 @stop",
        &["ok", "MPos:200.000"],
    ),
    row("G56", "work offset 3", &["G56"], "$G", &["G56", "ok"]),
    row("G57", "work offset 4", &["G57"], "$G", &["G57", "ok"]),
    row("G58", "work offset 5", &["G58"], "$G", &["G58", "ok"]),
    row("G59", "work offset 6", &["G59"], "$G", &["G59", "ok"]),
    row(
        "G61",
        "exact stop at corners",
        &["G61"],
        "$G",
        &["G61", "ok"],
    ),
    row(
        "G64 Q",
        "corner overlap in percent",
        &["G64 Q90"],
        "$G",
        &["G64 Q90", "ok"],
    ),
    row(
        "G64",
        "corner tolerance",
        &["G64 P0.1"],
        "$G",
        &["G64", "ok"],
    ),
    row("G80", "no motion mode", &["G80"], "$G", &["G80", "ok"]),
    row("G90", "coordinates", &["G91", "G90"], "$G", &["G90", "ok"]),
    row(
        "G91",
        "distances",
        &[AT, "G91"],
        "G0 X5 @stop",
        &["ok", "MPos:205.000"],
    ),
    row("G91.1", "arc centres are distances", NONE, "G91.1", &["ok"]),
    row(
        "G92",
        "the tool is at this work position",
        &[AT, "G92 X0"],
        "$#",
        &["[G92:200.000", "ok"],
    ),
    row(
        "G92.1",
        "takes G92 back",
        &[AT, "G92 X0", "G92.1"],
        "$#",
        &["[G92:0.000", "ok"],
    ),
    row(
        "G93",
        "feed as time of the move",
        &[AT, "G93"],
        "G1 X210 F60 @stop",
        &["ok", "MPos:210.000"],
    ),
    row(
        "G94",
        "feed per minute",
        &["G93", "G94"],
        "$G",
        &["G94", "ok"],
    ),
    row(
        "M0",
        "pause until cycle start",
        THERE,
        "M0 @pause",
        &["ok", "<Hold:0|"],
    ),
    row("M1", "optional pause: none", NONE, "M1", &["ok"]),
    row("M2", "end of program", &["G91", "M2"], "$G", &["G90", "ok"]),
    row(
        "M3",
        "closes the gripper",
        &[AT, "M3 @stop"],
        "@full",
        &["|A:S>"],
    ),
    row(
        "M4",
        "closes the gripper",
        &[AT, "M4 @stop"],
        "@full",
        &["|A:S>"],
    ),
    row(
        "M5",
        "opens the gripper",
        &[AT, "M3", "M7", "M5 @stop"],
        "@full",
        &["|A:F>"],
    ),
    row("M7", "blow-off on", &[AT, "M7 @stop"], "@full", &["|A:F>"]),
    row("M8", "blow-off on", &[AT, "M8 @stop"], "@full", &["|A:F>"]),
    row(
        "M9",
        "blow-off off",
        &[AT, "M3", "M8", "M9 @stop"],
        "@full",
        &["|A:S>"],
    ),
    row(
        "M30",
        "end of program",
        &["G91", "M30"],
        "$G",
        &["G90", "ok"],
    ),
    row(
        "M100",
        "prefilter, by number, frequency and damping",
        THERE,
        "M100 P1 Q10 R0.01",
        &["ok"],
    ),
    row(
        "M101",
        "elbow to the left: the arm passes its stretched pose, the tool comes back",
        THERE,
        "M101 @stop",
        &["ok", "<Idle|MPos:200.000,0.000"],
    ),
    row(
        "M102",
        "elbow to the right",
        &[AT, "M101"],
        "M102 @stop",
        &["ok", "<Idle|MPos:200.000,0.000"],
    ),
    row(
        "M103",
        "pick-and-place move: up, across and down again",
        THERE,
        "M103 X210 Z5 Q30 R60 P0.1 K4000 @stop",
        &["ok", "<Idle|MPos:210.000,0.000,5.000"],
    ),
    row(
        "N… *…",
        "line number and checksum",
        NONE,
        "N1 G21*27",
        &["ok"],
    ),
    row(
        "M110",
        "sets the line number, without one ends the count",
        &["N1 G21*27", "M110*125"],
        "G21",
        &["ok"],
    ),
    row("empty line", "is answered", NONE, "", &["ok"]),
    row(
        "( ) and ;",
        "comments",
        NONE,
        "(a comment) G21 ; another",
        &["ok"],
    ),
    row("$", "help", NONE, "$", &["[HLP:", "ok"]),
    row(
        "$$",
        "settings",
        NONE,
        "$$",
        &["$10=3", "$11=0.5", "$1041=6.34", "ok"],
    ),
    row(
        "$#",
        "offsets and stored positions",
        NONE,
        "$#",
        &[
            "[G54:", "[G59:", "[G28:", "[G30:", "[G92:", "[TLO:", "[PRB:", "ok",
        ],
    ),
    row(
        "$G",
        "modal state",
        NONE,
        "$G",
        &["[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0", "]", "ok"],
    ),
    row(
        "$I",
        "build info",
        NONE,
        "$I",
        &["[VER:1.1h.", "[OPT:", ",64,1024", "ok"],
    ),
    row(
        "$I+",
        "build info in grblHAL's words",
        NONE,
        "$I+",
        &["[AXS:4:XYZC]", "[NEWOPT:", "[FIRMWARE:Stillpoint", "ok"],
    ),
    row(
        "$I=",
        "names the controller",
        &["$I=left cell"],
        "$I",
        &[":left cell]", "ok"],
    ),
    row("$N", "start-up lines", NONE, "$N", &["$N0=", "$N1=", "ok"]),
    row(
        "$N0=",
        "sets a start-up line",
        &["$N0=G20"],
        "@reset",
        &["Grbl 1.1h", ">G20:ok"],
    ),
    row(
        "$n=",
        "sets a setting by number",
        &["$11=0.25"],
        "$11",
        &["$11=0.25", "ok"],
    ),
    row(
        "$name=",
        "sets a setting by name",
        &["$tolerance=0.25"],
        "$$",
        &["$11=0.25", "ok"],
    ),
    row(
        "$J=",
        "jogs",
        THERE,
        "$J=G91 X5 F3000 @stop",
        &["ok", "MPos:205.000"],
    ),
    row(
        "$C",
        "check mode: nothing moves",
        &["$C", AT, "G0 X250"],
        "?",
        &["<Check|MPos:0.000"],
    ),
    row(
        "$X",
        "unlocks",
        &[AT, "@reset in motion"],
        "$X",
        &["[MSG:Caution: Unlocked]", "ok"],
    ),
    row(
        "$H",
        "homes: encoders tell the position, or limit inputs are found",
        &["@encoders", "$1000=1"],
        "$H",
        &["ok"],
    ),
    row(
        "$ID=",
        "identifies the modes that a move (relative, with F) excites: frequency, damping, confidence",
        &[AT, "@accelerometer"],
        "$ID=X40 F9600",
        &["[ID:6.3", ",0.02", "]", "ok"],
    ),
    row(
        "$ID1=",
        "likewise by the following error that joint 1's drive tells; $ID2= to $ID4= by the others'",
        &[AT, "@accelerometer"],
        "$ID1=X40 F9600",
        &["[ID:3", ",0.02", "]", "ok"],
    ),
    row(
        "$ID",
        "what was identified last",
        &[AT, "@accelerometer", "$ID=X40 F9600"],
        "$ID",
        &["[ID:6.3", "ok"],
    ),
    row(
        "$ID=store",
        "makes the first of them the prefilter's mode, and keeps it",
        &[AT, "@accelerometer", "$ID=X40 F9600", "$ID=store"],
        "$frequency",
        &["=6.3", "ok"],
    ),
    row("$SLP", "sleeps until a reset", &["$SLP"], "?", &["<Sleep|"]),
    row(
        "$RST=$",
        "default settings",
        &["$11=0.25", "$RST=$"],
        "$11",
        &["$11=0.5", "ok"],
    ),
    row(
        "$RST=#",
        "default offsets",
        &[AT, "G10 L2 P1 X7", "$RST=#"],
        "$#",
        &["[G54:0.000", "ok"],
    ),
    row(
        "$RST=*",
        "everything to its default",
        &["$N0=G20", "$RST=*"],
        "$N",
        &["$N0=\r\n", "ok"],
    ),
    row(
        "$axes",
        "axes along which the first mode swings, `$axes2` the second one",
        &["$axes=x frequency2=9 axes2=yz"],
        "$1063",
        &["$1063=6", "ok"],
    ),
    row(
        "$ES",
        "describes the settings",
        NONE,
        "$ES",
        &["[SETTING:10|", "[SETTING:1052|", "ok"],
    ),
    row(
        "$EG",
        "describes their groups",
        NONE,
        "$EG",
        &["[SETTINGGROUP:0|0|Reports]", "ok"],
    ),
    row(
        "$EA",
        "describes the alarms",
        NONE,
        "$EA",
        &["[ALARMCODE:1||", "[ALARMCODE:3||", "ok"],
    ),
    row(
        "$EE",
        "describes the errors",
        NONE,
        "$EE",
        &["[ERRORCODE:1||", "[ERRORCODE:38||", "ok"],
    ),
    row(
        "$ACK",
        "the sender knows of an error",
        &["$error-safe=1", "G5", "$ACK"],
        "G21",
        &["ok"],
    ),
];

const REALTIME: &[Row] = &[
    row(
        "?",
        "status report",
        NONE,
        "?",
        &["<Idle|MPos:0.000,0.000,0.000,0.000|Bf:64,1024|FS:0,0|WCO:0.000"],
    ),
    row(
        "0x18",
        "soft reset",
        NONE,
        "@reset",
        &["Grbl 1.1h ['$' for help]"],
    ),
    row(
        "!",
        "feed hold",
        &[AT, "G1 X300 F600", "@wait 500"],
        "@! 1000",
        &["<Hold:0|"],
    ),
    row(
        "~",
        "cycle start",
        &[AT, "G1 X300 F6000", "@wait 500", "@! 1000"],
        "@~ stop",
        &["MPos:300.000"],
    ),
    row(
        "0x84",
        "safety door: hold",
        &[AT, "G1 X300 F600", "@wait 500"],
        "@door 1000",
        &["<Door:0|"],
    ),
    row(
        "0x85",
        "jog cancel",
        &[AT, "$J=X300 F600", "@wait 500"],
        "@cancel 1000",
        &["<Idle|MPos:2"],
    ),
    row(
        "0x87",
        "full status report",
        NONE,
        "@full",
        &["|Bf:", "|J:", "|WCO:", "|Ov:"],
    ),
    row(
        "0x19",
        "stop without alarm",
        &[AT, "G1 X300 F600", "@wait 500"],
        "@stop 1000",
        &["[MSG:Stopped]", "<Idle|"],
    ),
    row(
        "0x90",
        "feed override 100 %",
        &["@byte 91", "@byte 90"],
        "@full",
        &["|Ov:100,100,100"],
    ),
    row(
        "0x91",
        "feed override +10 %",
        &["@byte 91"],
        "@full",
        &["|Ov:110,100,100"],
    ),
    row(
        "0x92",
        "feed override −10 %",
        &["@byte 92"],
        "@full",
        &["|Ov:90,100,100"],
    ),
    row(
        "0x93",
        "feed override +1 %",
        &["@byte 93"],
        "@full",
        &["|Ov:101,100,100"],
    ),
    row(
        "0x94",
        "feed override −1 %",
        &["@byte 94"],
        "@full",
        &["|Ov:99,100,100"],
    ),
    row(
        "0x95",
        "rapid override 100 %",
        &["@byte 97", "@byte 95"],
        "@full",
        &["|Ov:100,100,100"],
    ),
    row(
        "0x96",
        "rapid override 50 %",
        &["@byte 96"],
        "@full",
        &["|Ov:100,50,100"],
    ),
    row(
        "0x97",
        "rapid override 25 %",
        &["@byte 97"],
        "@full",
        &["|Ov:100,25,100"],
    ),
    row(
        "other bytes above 0x7F",
        "are dropped",
        NONE,
        "@byte a5",
        &[],
    ),
];

const REFUSALS: &[Row] = &[
    row("error:1", "", NONE, "=5", &["error:1"]),
    row("error:2", "", NONE, "G0 X", &["error:2"]),
    row("error:3", "", NONE, "$nothing", &["error:3"]),
    row("error:4", "", NONE, "F-1", &["error:4"]),
    row("error:5", "", NONE, "$H", &["error:5"]),
    row(
        "error:7",
        "",
        &["@broken store"],
        "$11=0.25",
        &["[MSG:", "error:7"],
    ),
    row(
        "error:8",
        "",
        &[AT, "G1 X300 F600", "@wait 500"],
        "$$",
        &["error:8"],
    ),
    row(
        "error:9",
        "",
        &[AT, "@reset in motion"],
        "G0 X210",
        &["error:9"],
    ),
    row("error:10", "", NONE, "$20=1", &["error:10"]),
    row("error:11", "", NONE, "@long", &["error:11"]),
    row("error:14", "", NONE, "@long startup", &["error:14"]),
    row("error:15", "", THERE, "$J=X1000 F600", &["error:15"]),
    row("error:16", "", THERE, "$J=X210 F600 M3", &["error:16"]),
    row("error:20", "", NONE, "G5", &["error:20"]),
    row("error:21", "", NONE, "G0 G1", &["error:21"]),
    row("error:22", "", THERE, "G1 X210", &["error:22"]),
    row("error:23", "", NONE, "G1.5", &["error:23"]),
    row("error:24", "", THERE, "G49 G0 X210", &["error:24"]),
    row("error:25", "", THERE, "G0 X1 X2", &["error:25"]),
    row("error:26", "", THERE, "G92", &["error:26"]),
    row("error:27", "", NONE, "N10000001", &["error:27"]),
    row("error:28", "", NONE, "G4", &["error:28"]),
    row("error:29", "", THERE, "G10 L2 P9 X1", &["error:29"]),
    row(
        "error:30",
        "",
        &[AT, "F100"],
        "G53 G2 X210 R10",
        &["error:30"],
    ),
    row("error:31", "", &[AT, "G80"], "X210", &["error:31"]),
    row("error:32", "", &[AT, "F100"], "G2 Z5 I10", &["error:32"]),
    row(
        "error:33",
        "",
        &[AT, "F100"],
        "G2 X210 I3 J7",
        &["error:33"],
    ),
    row("error:34", "", &[AT, "F100"], "G2 X230 R1", &["error:34"]),
    row("error:35", "", &[AT, "F100"], "G2 X210", &["error:35"]),
    row("error:36", "", NONE, "G21 R5", &["error:36"]),
    row("error:37", "", THERE, "G43.1 X5", &["error:37"]),
    row("error:38", "", NONE, "T256", &["error:38"]),
    row("error:60", "", NONE, "X99999999999999", &["error:60"]),
    row("error:61", "", THERE, "G0 X5000", &["error:61"]),
    row("error:62", "", NONE, "G91 G0 X1", &["error:62"]),
    row("error:63", "", NONE, "N1 G21*0", &["error:63"]),
    row("error:64", "", NONE, "@many words", &["error:64"]),
    row("error:65", "", THERE, "M100 P1 G0 X210", &["error:65"]),
    row(
        "error:66",
        "",
        &["$error-safe=1", "G5"],
        "G21",
        &["error:66"],
    ),
    row("error:67", "", &["N1 G21*27"], "N9 G21*19", &["error:67"]),
    row("error:70", "", NONE, "G0 X1000 Y0", &["error:70"]),
    row("error:71", "", THERE, "G0 X349.9", &["error:71"]),
    row("error:72", "", THERE, "G0 Z250", &["error:72"]),
    row("error:73", "", THERE, "G1 X300 F0.0001", &["error:73"]),
    row(
        "error:75",
        "",
        &[AT, "F100"],
        "G18 G2 X210 I5",
        &["error:75"],
    ),
    row("error:76", "", THERE, "M100 P6 Q1", &["error:76"]),
    row("error:77", "", NONE, "$11=-1", &["error:77"]),
    row("error:78", "", NONE, "$frequency=1.5", &["error:78"]),
    row("error:79", "", &["$robot=delta"], "M101", &["error:79"]),
    row("error:80", "", NONE, "G64 P1 Q50", &["error:80"]),
    row("error:85", "", THERE, "M103 X210 Q50 R40", &["error:85"]),
    row(
        "error:92",
        "",
        THERE,
        "$ID=X10 F9600",
        &["[MSG:The accelerometer is silent", "error:92"],
    ),
    row("error:93", "", NONE, "$ID=store", &["error:93"]),
];

const ALARMS: &[Row] = &[
    row(
        "ALARM:1",
        "",
        &["$21=1", AT, "G1 X300 F6000", "@wait 500"],
        "@limit 1500",
        &["ALARM:1", "[MSG:Reset to continue]", "<Alarm|"],
    ),
    row(
        "ALARM:2",
        "",
        &["@encoders", "$1000=1", "$20=1", "$H"],
        "G0 X1000 @stop",
        &["error:71", "ALARM:2", "[MSG:Reset to continue]", "<Alarm|"],
    ),
    row(
        "ALARM:3",
        "",
        &[AT],
        "@reset in motion",
        &[
            "ALARM:3",
            "Grbl 1.1h",
            "[MSG:'$H'|'$X' to unlock]",
            "<Alarm|",
        ],
    ),
    row(
        "ALARM:6",
        "",
        &["@switches", "$1004=15", "@begin $H"],
        "@soft reset",
        &["ALARM:6", "Grbl 1.1h", "'$H'|'$X' to unlock", "<Alarm|"],
    ),
    row(
        "ALARM:7",
        "",
        &["@switches", "$1004=15", "@begin $H"],
        "@open door",
        &["error:9", "ALARM:7", "<Alarm|"],
    ),
    row(
        "ALARM:8",
        "",
        &["@switches 1", "$1004=15"],
        "$H @stop",
        &["ALARM:8", "error:9", "<Alarm|"],
    ),
    row(
        "ALARM:9",
        "",
        &["@switches 0", "$1004=15"],
        "$H @stop",
        &["ALARM:9", "error:9", "<Alarm|"],
    ),
];

/// Sends one item, waits for its effect, and returns what was heard.
fn send(desk: &mut SerialLoop<'_>, item: &str) -> String {
    let wait = |desk: &mut SerialLoop<'_>, text: &str| {
        desk.run_ms(text.parse().unwrap_or(0));
        desk.ask_status(b'?');
        desk.heard()
    };
    if let Some(line) = item.strip_suffix(" @stop") {
        let answer = desk.ask(line);
        desk.run_ms(60);
        desk.run_ms(30_000);
        desk.ask_status(b'?');
        return answer + &desk.heard();
    }
    if let Some(line) = item.strip_suffix(" @pause") {
        let answer = desk.ask(line);
        desk.run_ms(3000);
        desk.ask_status(b'?');
        return answer + &desk.heard();
    }
    let Some(own) = item.strip_prefix('@') else {
        return if item == "?" {
            desk.ask_status(b'?');
            desk.heard()
        } else {
            desk.ask(item)
        };
    };
    match own.split_once(' ').unwrap_or((own, "")) {
        ("wait", ms) => wait(desk, ms),
        ("full", _) => {
            desk.ask_status(0x87);
            desk.heard()
        }
        ("byte", hex) => {
            desk.send(&[u8::from_str_radix(hex, 16).unwrap()]);
            desk.heard()
        }
        ("!", ms) => {
            desk.send(b"!");
            wait(desk, ms)
        }
        ("~", _) => {
            desk.send(b"~");
            wait(desk, "30000")
        }
        ("door", ms) => {
            desk.send(&[0x84]);
            wait(desk, ms)
        }
        ("cancel", ms) => {
            desk.send(&[0x85]);
            wait(desk, ms)
        }
        ("stop", ms) => {
            desk.send(&[0x19]);
            wait(desk, ms)
        }
        ("limit", ms) => {
            desk.inputs.limits = 1;
            wait(desk, ms)
        }
        ("reset", "") => {
            desk.send(&[0x18]);
            wait(desk, "10")
        }
        ("reset", _) => {
            desk.ask("G1 X300 F600");
            desk.run_ms(700);
            desk.send(&[0x18]);
            wait(desk, "2000")
        }
        ("encoders", _) => {
            desk.encoders = Some(desk.joints_at(200.0, 0.0));
            desk.run_ms(2);
            String::new()
        }
        ("accelerometer", _) => {
            desk.plant = Some(plant(6.34, 0.022, 2));
            desk.run_ms(100);
            String::new()
        }
        ("switches", stuck) => {
            let mut arm = bench_arm();
            arm.switches[0].stuck = stuck.parse::<u8>().ok().map(|active| active != 0);
            desk.arm = Some(arm);
            String::new()
        }
        ("begin", line) => {
            desk.send(format!("{line}\n").as_bytes());
            wait(desk, "500")
        }
        ("soft", _) => {
            desk.send(&[0x18]);
            wait(desk, "2000")
        }
        ("open", _) => {
            desk.inputs.door = true;
            wait(desk, "2000")
        }
        ("broken", _) => {
            desk.store_works = false;
            String::new()
        }
        ("long", "") => desk.ask(&format!("G0 {}", "X1".repeat(300))),
        ("long", _) => desk.ask(&format!("$N0=G21 ({})", "x".repeat(90))),
        ("many", _) => desk.ask(&"X1".repeat(40)),
        other => panic!("no such item: {other:?}"),
    }
}

fn check(row: &Row) {
    with_controller(Records::new(), |desk| {
        desk.run_ms(5);
        desk.heard();
        for item in row.given {
            send(desk, item);
        }
        let heard = send(desk, row.then);
        let mut rest = heard.as_str();
        for part in row.heard {
            let Some(at) = rest.find(part) else {
                panic!(
                    "{}: {:?} after {:?} says {heard:?}, not {part:?}",
                    row.what, row.then, row.given
                );
            };
            rest = &rest[at + part.len()..];
        }
    });
}

#[test]
fn every_command() {
    COMMANDS.iter().for_each(check);
}

#[test]
fn every_realtime_byte() {
    REALTIME.iter().for_each(check);
}

#[test]
fn every_error() {
    REFUSALS.iter().for_each(check);
    for (code, sentence) in ERRORS {
        let what = format!("error:{code}");
        // The look-ahead is never full for a line that has waited for its room.
        assert!(
            code == 74 || REFUSALS.iter().any(|row| row.what == what),
            "{what} has no row: {sentence}"
        );
    }
}

#[test]
fn every_alarm() {
    ALARMS.iter().for_each(check);
}

/// The table as people read it.
fn table() -> String {
    let mut text = String::from(
        "# The dialect\n\nEvery row is a test: `cargo test --release --test protocol dialect`.\n",
    );
    let errors: Vec<(String, String, &Row)> = REFUSALS
        .iter()
        .map(|row| {
            let code: u8 = row.what.trim_start_matches("error:").parse().unwrap();
            let (_, sentence) = ERRORS
                .into_iter()
                .find(|(other, _)| *other == code)
                .unwrap();
            (row.what.into(), sentence.into(), row)
        })
        .collect();
    let alarms = ALARMS.iter().map(|row| {
        let alarm = Alarm::ALL
            .into_iter()
            .find(|alarm| row.what == format!("ALARM:{}", alarm.code()));
        (row.what.into(), alarm.unwrap().to_string(), row)
    });
    let plain = |rows: &'static [Row]| -> Vec<(String, String, &Row)> {
        rows.iter()
            .map(|row| (row.what.into(), row.meaning.into(), row))
            .collect()
    };
    let sections = [
        ("Commands", plain(COMMANDS)),
        ("Realtime bytes", plain(REALTIME)),
        ("Errors", errors),
        ("Alarms", alarms.collect()),
    ];
    let shown = |text: &str| text.replace('|', "\\|").replace("\r\n", "");
    for (title, rows) in sections {
        let _ = write!(
            text,
            "\n## {title}\n\n| what | meaning | tested with | says |\n|---|---|---|---|\n"
        );
        for (what, meaning, row) in rows {
            let sent: Vec<_> = row
                .given
                .iter()
                .chain([&row.then])
                .map(|item| format!("`{}`", shown(item)))
                .collect();
            let heard: Vec<_> = row
                .heard
                .iter()
                .map(|part| format!("`{}`", shown(part)))
                .collect();
            let _ = writeln!(
                text,
                "| `{}` | {} | {} | {} |",
                shown(&what),
                shown(&meaning),
                sent.join(" "),
                heard.join(" ")
            );
        }
    }
    text
}

#[test]
fn the_table_shows_the_rows() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("dialect.md");
    if std::env::var_os("UPDATE_TABLES").is_some() {
        std::fs::write(&file, table()).unwrap();
    }
    let kept = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(
        kept == table(),
        "the table is out of date: run UPDATE_TABLES=1 cargo test --release --test protocol dialect"
    );
}
