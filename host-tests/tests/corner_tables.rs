//! [Yeh26] Tables 1 and 2: published values and the exact continuous solution beside them.

use planner_core::corner::{self, Side};
use planner_core::prefilter::{Kind, Prefilter, PrefilterConfig};

#[test]
fn every_row_of_the_published_corner_tables() {
    let table = include_str!("published/corner_tables.csv");
    let mut rows = 0;
    for line in table.lines().skip(1) {
        let cells: Vec<&str> = line.splitn(12, ',').collect();
        let number = |i: usize| cells[i].parse::<f64>().unwrap();
        let prefilter = Prefilter::new(&PrefilterConfig {
            kind: Kind::from_name(cells[0]).unwrap(),
            ..PrefilterConfig::default()
        })
        .unwrap();
        let angle = number(1).to_radians();
        let side = |tangent| Side {
            feed_mm_s: 160.0,
            tangent,
            heading_rate_per_mm: 0.0,
            length_mm: 1000.0,
        };
        let corner = corner::solve(
            &side([1.0, 0.0, 0.0]),
            &side([angle.cos() as f32, angle.sin() as f32, 0.0]),
            &prefilter.reversed_response(),
            &prefilter.response(),
            number(2) as f32,
        );
        let got = [
            corner.deceleration_s,
            corner.approach_s,
            corner.cornering_s,
            corner.dwell_s,
        ]
        .map(f64::from);
        for (i, got) in got.into_iter().enumerate() {
            let off = got - number(7 + i);
            assert!(off.abs() < 20e-6, "{line}\ncolumn {i}: {got}, off by {off}");
        }
        assert!(
            f64::from(corner.error_mm) <= number(2),
            "{line}: {corner:?}"
        );
        // published: t_dec1, t_m, t_c, t_d; two rows of t_m excepted, see their notes
        for (i, (bound, got)) in [0.5e-3, 0.5e-3, 1e-3, 0.75e-3]
            .into_iter()
            .zip(got)
            .enumerate()
        {
            let off = (got - number(3 + i)).abs();
            let excepted = i == 1 && !cells[11].is_empty();
            assert!(
                off <= bound + 1e-12 || excepted,
                "{line}\ncolumn {i}: off by {off}"
            );
        }
        rows += 1;
    }
    assert_eq!(rows, 40);
}
