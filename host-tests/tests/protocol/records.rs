//! What is kept over a restart.

use host_tests::serial_loop::{Records, with_controller};
use planner_core::protocol::Record;

/// Powers up with `records`, asks the questions, and returns what is kept then and said.
fn session(records: Records, lines: &[&str]) -> (Records, Vec<String>) {
    with_controller(records, |desk| {
        desk.run_ms(5);
        let mut heard = vec![desk.heard()];
        heard.extend(lines.iter().map(|line| desk.ask(line)));
        (desk.records.clone(), heard)
    })
}

#[test]
fn everything_comes_back_after_a_restart() {
    let lines = [
        "$tolerance=0.125",
        "$prefilter=zv",
        "$N0=G20",
        "$I=left cell",
        "G0 X250 Y0",
        "G10 L2 P3 X1 Y2 Z3 C4",
        "G28.1",
    ];
    let (records, heard) = session(Records::new(), &lines);
    assert!(
        heard[1..].iter().all(|answer| answer.contains("ok")),
        "{heard:?}"
    );
    let (_, heard) = session(records, &["$11", "$1040", "$N", "$I", "$#", "$G"]);
    assert!(heard[0].contains(">G20:ok"), "{heard:?}");
    for (answer, part) in heard[1..].iter().zip([
        "$11=0.125",
        "$1040=1",
        "$N0=G20",
        ":left cell]",
        "[G56:1.000,2.000,3.000,4.000]",
        "G20",
    ]) {
        assert!(answer.contains(part), "{part}: {answer}");
    }
    assert!(heard[5].contains("[G28:250.000"), "{}", heard[5]);
}

#[test]
fn damaged_records_are_passed_over() {
    for bytes in [
        vec![],
        vec![0xFF; 500],
        vec![7; 3],
        (0..=255).collect::<Vec<u8>>(),
    ] {
        let records: Records = Record::ALL
            .into_iter()
            .map(|record| (record, bytes.clone()))
            .collect();
        let (_, heard) = session(records, &["$$", "G0 X200 Y0", "$#"]);
        assert!(heard[1].contains("$11=0.5"), "{heard:?}");
        assert!(heard[3].ends_with("ok\r\n"), "{heard:?}");
    }
}

#[test]
fn a_map_is_given_line_by_line_and_comes_back() {
    let lines = [
        "$map=2,2,100,320,-140,140",
        "$map1=16/0.02,8.5/0.03",
        "$map",
        "$map2=15.75/0.02,8/0.02",
        "$map3=1/0",
        "$map1=500/0.02,8/0.02",
        "G0 X250 Y0",
        "G1 X300 F6000",
        "M100 Q5",
        "M100 P1",
    ];
    let (records, heard) = session(Records::new(), &lines);
    assert!(heard[3].contains("[MSG:The map is in force when all its rows are given]"));
    for (answer, part) in heard[1..].iter().zip([
        "ok",
        "ok",
        "$map1=16.000/0.02000,8.500/0.03000",
        "ok",
        "error:",
        "error:",
        "ok",
        "ok",
        "error:76",
        "ok",
    ]) {
        assert!(answer.contains(part), "{part}: {heard:?}");
    }
    let (_, heard) = session(records.clone(), &["$map", "$map=0", "$map"]);
    assert!(heard[1].contains("$map=2,2,100,320,-140,140"), "{heard:?}");
    assert!(
        heard[1].contains("$map2=15.750/0.02000,8.000/0.02000"),
        "{heard:?}"
    );
    assert!(
        heard[1].contains("[MSG:fir-zvd made for the mode where"),
        "{heard:?}"
    );
    assert!(
        heard[3].contains("$map=0") && !heard[3].contains("MSG"),
        "{heard:?}"
    );
    let (_, heard) = session(records, &["$automatic=1 residual-limit=0.05", "$map"]);
    assert!(
        heard[2].contains("shortest whose residual stays below 5 % of a mode known to 5 %"),
        "{heard:?}"
    );
}
