//! What realtime bytes do to a robot in motion, and what happens by itself.

use host_tests::serial_loop::{Records, SerialLoop, with_controller};

fn with_robot(body: impl FnOnce(&mut SerialLoop<'_>)) {
    with_controller(Records::new(), |desk| {
        desk.run_ms(2);
        assert!(desk.heard().contains("Grbl 1.1h ['$' for help]"));
        assert!(desk.ask("G0 X200 Y0").contains("ok"));
        body(desk);
    });
}

fn x_mm(desk: &SerialLoop<'_>) -> f64 {
    desk.setpoint().pose.x.to_num()
}

#[test]
fn a_hold_stops_on_the_way_and_a_resume_arrives() {
    with_robot(|desk| {
        desk.ask("G1 X300 F6000");
        desk.run_ms(500);
        assert_eq!(desk.state(), "Run");
        desk.send(b"!");
        assert_eq!(desk.state(), "Hold:1");
        assert!(desk.run_until("Hold:0"));
        let held = x_mm(desk);
        assert!(held > 200.0 && held < 299.0, "{held}");
        desk.run_ms(5000);
        assert_eq!(x_mm(desk), held);
        desk.send(b"~");
        assert!(desk.run_until("Idle"));
        assert_eq!(x_mm(desk), 300.0);
    });
}

#[test]
fn lines_sent_in_a_hold_wait_for_the_resume() {
    with_robot(|desk| {
        desk.send(b"!");
        assert_eq!(desk.state(), "Hold:0");
        assert!(desk.ask("G1 X250 F6000").contains("ok"));
        desk.run_ms(2000);
        assert_eq!(x_mm(desk), 200.0);
        desk.send(b"~");
        assert!(desk.run_until("Idle"));
        assert_eq!(x_mm(desk), 250.0);
    });
}

#[test]
fn a_reset_in_motion_stops_shaped_and_keeps_the_position() {
    with_robot(|desk| {
        desk.ask("G1 X300 F6000");
        desk.ask("G1 X200");
        desk.run_ms(700);
        desk.heard();
        desk.send(b"\x18");
        desk.run_ms(10);
        assert!(!desk.heard().contains("ALARM"), "it is still stopping");
        assert!(desk.run_until("Alarm"));
        let heard = desk.heard();
        let order = ["ALARM:3", "Grbl 1.1h", "[MSG:'$H'|'$X' to unlock]"];
        let places: Vec<_> = order.iter().map(|part| heard.find(part).unwrap()).collect();
        assert!(places.is_sorted(), "{heard}");
        let stopped = x_mm(desk);
        desk.run_ms(3000);
        assert_eq!(x_mm(desk), stopped);
        assert!(desk.ask("G1 X210 F6000").contains("error:9"));
        assert!(desk.ask("$X").contains("[MSG:Caution: Unlocked]"));
        // The position is still known: a distance counts from there.
        assert!(desk.ask("G91 G1 X5 F600").contains("ok"));
        assert!(desk.run_until("Idle"));
        assert!((x_mm(desk) - stopped - 5.0).abs() < 1e-5);
    });
}

#[test]
fn a_reset_at_rest_forgets_the_lines_before_it_and_none_behind_it() {
    with_robot(|desk| {
        desk.send(b"G91\nG20\nG2");
        desk.run_ms(5);
        desk.heard();
        desk.send(b"G91\n\x18G21\n");
        desk.run_ms(20);
        let heard = desk.heard();
        assert_eq!(heard.matches("ok").count(), 1, "{heard}");
        assert!(
            desk.ask("$G").contains("G21 G90"),
            "modes are those of the start"
        );
    });
}

#[test]
fn a_jog_is_cancelled_and_leaves_no_alarm() {
    with_robot(|desk| {
        assert!(desk.ask("$J=G91 X100 F6000").contains("ok"));
        desk.run_ms(400);
        assert_eq!(desk.state(), "Jog");
        assert!(desk.ask("G0 X210").contains("error:9"));
        desk.send(&[0x85]);
        assert!(desk.run_until("Idle"));
        let stopped = x_mm(desk);
        assert!(stopped > 200.0 && stopped < 290.0);
        assert!(desk.ask("$J=G91 X-5 F6000").contains("ok"));
        assert!(desk.run_until("Idle"));
        assert!((x_mm(desk) - stopped + 5.0).abs() < 1e-5);
        assert!(!desk.heard().contains("ALARM"));
        // A jog changes no mode.
        assert!(desk.ask("$G").contains("G90"));
    });
}

#[test]
fn a_feed_hold_ends_a_jog() {
    with_robot(|desk| {
        desk.ask("$J=X300 F6000");
        desk.ask("$J=X210 F6000");
        desk.run_ms(400);
        desk.send(b"!");
        assert!(desk.run_until("Idle"));
        let stopped = x_mm(desk);
        desk.run_ms(2000);
        assert_eq!(x_mm(desk), stopped);
    });
}

#[test]
fn overrides_change_the_speed_under_way() {
    with_robot(|desk| {
        let speed = |desk: &mut SerialLoop<'_>| {
            desk.heard();
            desk.send(b"?");
            let report = desk.heard();
            let start = report.find("FS:").unwrap() + 3;
            let end = report[start..].find(',').unwrap();
            report[start..start + end]
                .parse::<u32>()
                .unwrap_or_else(|_| panic!("{report}"))
        };
        desk.ask("G1 X300 F1200");
        desk.run_ms(1500);
        let plain = speed(desk);
        assert!((1195..=1205).contains(&plain), "{plain}");
        for _ in 0..5 {
            desk.send(&[0x92]);
        }
        desk.run_ms(700);
        assert!((595..=605).contains(&speed(desk)));
        for _ in 0..10 {
            desk.send(&[0x91]);
        }
        desk.run_ms(700);
        assert!((1795..=1805).contains(&speed(desk)));
        assert!(desk.run_until("Idle"));
        assert_eq!(x_mm(desk), 300.0);
    });
}

#[test]
fn m0_pauses_until_cycle_start() {
    with_robot(|desk| {
        desk.send(b"G1 X220 F6000\nM0\nG1 X240\n");
        assert!(desk.run_until("Hold:0"));
        assert_eq!(x_mm(desk), 220.0);
        desk.run_ms(3000);
        assert_eq!(x_mm(desk), 220.0);
        desk.send(b"~");
        assert!(desk.run_until("Idle"));
        assert_eq!(x_mm(desk), 240.0);
    });
}

#[test]
fn outputs_switch_where_the_tool_has_come_to_rest() {
    with_robot(|desk| {
        desk.send(b"G1 X220 F6000\nM3\nG1 X240\nM5\nM8\nG1 X220\n");
        let mut seen = vec![];
        for _ in 0..8000 {
            desk.tick();
            let setpoint = *desk.setpoint();
            if seen.last().map(|(outputs, _)| *outputs) != Some(setpoint.outputs) {
                seen.push((setpoint.outputs, setpoint.pose.x.to_num::<f64>()));
            }
        }
        let expected = [(0, 200.0), (1, 220.0), (0, 240.0), (2, 240.0)];
        let first = seen.iter().position(|(outputs, _)| *outputs != 0).unwrap();
        assert_eq!(
            seen[first - 1..]
                .iter()
                .skip(1)
                .copied()
                .collect::<Vec<_>>(),
            expected[1..]
        );
        assert_eq!(x_mm(desk), 220.0);
    });
}

#[test]
fn a_reset_keeps_what_the_gripper_holds_and_takes_the_prefilter_back() {
    with_robot(|desk| {
        desk.send(b"M3\nM100 P1 Q20\nG1 X300 F6000\n");
        desk.run_ms(800);
        assert_eq!(desk.setpoint().outputs, 1);
        desk.send(b"\x18");
        assert!(desk.run_until("Alarm"));
        desk.ask("$X");
        assert_eq!(desk.setpoint().outputs, 1);
        assert!(desk.ask("$G").contains("M3"));
        desk.ask("M5");
        assert!(desk.run_until("Idle"));
        assert_eq!(desk.setpoint().outputs, 0);
        // With FIR-ZVD again a move of 5 mm takes more than its prefilter's 0.3 s.
        desk.heard();
        desk.ask("G91 G1 X5 F6000");
        desk.run_ms(60);
        desk.run_ms(250);
        assert_eq!(desk.state(), "Run");
    });
}

#[test]
fn silence_holds_a_running_program() {
    with_robot(|desk| {
        assert!(desk.ask("$link-timeout=0.5").contains("ok"));
        desk.ask("G1 X300 F600");
        for _ in 0..20 {
            desk.run_ms(100);
            desk.send(b"?");
        }
        assert_eq!(desk.state(), "Run");
        desk.heard();
        desk.run_ms(501);
        assert!(desk.heard().contains("[MSG:Nothing was heard"));
        assert!(desk.run_until("Hold:0"));
        assert!(x_mm(desk) < 299.0);
        desk.send(b"~");
        for _ in 0..200 {
            desk.run_ms(100);
            desk.send(b"?");
        }
        assert_eq!(x_mm(desk), 300.0);
    });
}

#[test]
fn after_an_error_lines_already_sent_are_refused_until_acknowledged() {
    with_robot(|desk| {
        desk.ask("$error-safe=1");
        desk.send(b"G1 X210 F6000\nG1 X2x0\nG1 X230\nG1 X240\n");
        desk.run_ms(200);
        let heard = desk.heard();
        assert_eq!(heard.matches("error:66").count(), 2, "{heard}");
        assert!(desk.run_until("Idle"));
        assert_eq!(x_mm(desk), 210.0);
        assert!(desk.ask("$ACK").contains("ok"));
        assert!(desk.ask("G1 X220").contains("ok"));
        assert!(desk.run_until("Idle"));
        assert_eq!(x_mm(desk), 220.0);
    });
}

#[test]
fn without_that_setting_later_lines_run_as_in_grbl() {
    with_robot(|desk| {
        desk.send(b"G1 X210 F6000\nG1 X2x0\nG1 X230\n");
        assert!(desk.run_until("Idle"));
        assert_eq!(x_mm(desk), 230.0);
    });
}

#[test]
fn check_mode_checks_and_moves_nothing() {
    with_robot(|desk| {
        assert!(desk.ask("$C").contains("[MSG:Enabled]"));
        assert!(desk.ask("G1 X300 F6000").contains("ok"));
        assert!(desk.ask("G1 X900").contains("error:71"));
        desk.run_ms(3000);
        assert_eq!(x_mm(desk), 200.0);
        let answer = desk.ask("$C");
        desk.run_ms(20);
        let heard = answer + &desk.heard();
        assert!(
            heard.contains("[MSG:Disabled]") && heard.contains("Grbl 1.1h"),
            "{heard}"
        );
        assert!(desk.ask("G1 X210 F6000").contains("ok"));
        assert!(desk.run_until("Idle"));
        assert_eq!(x_mm(desk), 210.0);
    });
}

#[test]
fn a_door_holds_until_it_is_closed_and_somebody_says_so() {
    with_robot(|desk| {
        desk.ask("G1 X300 F6000");
        desk.run_ms(500);
        desk.inputs.door = true;
        desk.run_ms(2);
        assert_eq!(desk.state(), "Door:2");
        desk.run_ms(2000);
        assert_eq!(desk.state(), "Door:1");
        desk.send(b"~");
        desk.run_ms(1000);
        assert_eq!(desk.state(), "Door:1");
        desk.inputs.door = false;
        desk.run_ms(2);
        assert_eq!(desk.state(), "Door:0");
        desk.send(b"~");
        assert!(desk.run_until("Idle"));
        assert_eq!(x_mm(desk), 300.0);
    });
}

#[test]
fn any_storm_of_realtime_bytes_ends_in_a_known_state() {
    with_robot(|desk| {
        let bytes = [
            b'!', b'~', b'?', 0x84, 0x85, 0x87, 0x90, 0x91, 0x97, 0x19, 0x18,
        ];
        desk.ask("G1 X300 F6000");
        desk.run_ms(300);
        for i in 0..20_000_usize {
            desk.send(&[bytes[(i * i + i / 7) % bytes.len()]]);
            if i % 40 == 0 {
                desk.tick();
                desk.heard();
            }
        }
        desk.send(&[0x18]);
        desk.run_ms(3000);
        desk.heard();
        assert!(desk.ask("$X").contains("ok"));
        assert_eq!(desk.state(), "Idle");
        assert!(desk.ask("G90 G1 X210 F6000").contains("ok"));
        assert!(desk.run_until("Idle"));
        assert_eq!(x_mm(desk), 210.0);
    });
}

/// After a sender that numbers its lines comes one that does not.
#[test]
fn a_count_of_lines_is_ended_by_m110_or_left_behind_by_a_reset() {
    use host_tests::link::wire::checked;
    with_robot(|desk| {
        desk.ask(&checked("G21", 7));
        assert!(desk.ask("G21").contains("error:67"), "it may be damaged");
        assert!(desk.ask("M110").contains("error:67"), "likewise");
        assert!(desk.ask(&checked("", 9)).contains("Next is N8"));
        assert!(desk.ask("M110*125").contains("ok"));
        assert!(desk.ask("G21").contains("ok"));

        desk.ask(&checked("G21", 7));
        desk.run_ms(100);
        desk.send(b"\x18");
        desk.run_ms(10);
        desk.heard();
        // What is left of a line whose last byte became the reset.
        assert!(desk.ask("").contains("ok"));
        let said = desk.ask(&checked("G21", 8));
        assert!(said.contains("error:67"), "{said}");
        assert!(desk.ask("N8 G21").contains("error:67"), "it may be damaged");
        assert!(desk.ask("G21").contains("ok"));
        assert!(desk.ask("N8 G21").contains("ok"));
    });
}

/// Senders begin with a reset; the program's first point still says where the tool is.
#[test]
fn a_reset_does_not_make_the_position_known() {
    with_controller(Records::new(), |desk| {
        desk.run_ms(2);
        desk.send(b"\x18");
        desk.run_ms(10);
        desk.heard();
        assert!(desk.ask("G0 X200 Y10").contains("ok"));
        desk.run_ms(10);
        assert_eq!(desk.state(), "Idle");
        assert_eq!(x_mm(desk), 200.0);
        desk.send(b"\x18");
        desk.run_ms(10);
        desk.heard();
        assert!(desk.ask("G0 X210").contains("ok"));
        assert_eq!(desk.state(), "Run", "now it is known, and moves");
    });
}

#[test]
fn reports_show_the_line_under_way_if_the_program_numbers_its_lines() {
    with_robot(|desk| {
        let report = |desk: &mut SerialLoop<'_>| {
            desk.heard();
            desk.send(b"?");
            desk.heard()
        };
        desk.ask("G1 X210 F600");
        desk.run_ms(300);
        assert!(!report(desk).contains("Ln:"));
        assert!(desk.run_until("Idle"));
        desk.ask("N70 G1 X230 F6000");
        desk.ask("N80 G1 Y40");
        desk.run_ms(150);
        assert!(report(desk).contains("|Ln:70|"));
        desk.run_ms(400);
        assert!(report(desk).contains("|Ln:80|"));
        assert!(desk.run_until("Idle"));
        assert!(!report(desk).contains("Ln:"));
    });
}
