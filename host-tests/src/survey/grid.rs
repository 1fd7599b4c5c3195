//! Where the nodes of a map lie.

use std::str::FromStr;

use planner_core::posture::{MapError, MapNode, ModeMap, ModeMapConfig};

/// The grid of a survey.
#[derive(Clone, Debug, PartialEq)]
pub enum Grid {
    /// That of the controller's map.
    OfTheMap,
    /// A map of which only the places count.
    Given(Box<ModeMapConfig>),
}

/// Why a text is no grid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// It cannot be read.
    #[error(
        "give COLUMNS,ROWS,X0,X1,Y0,Y1 as in 5,4,120,300,-120,120, or map for that of the controller"
    )]
    Unreadable,
    /// It is no place for a map.
    #[error(transparent)]
    NoMap(#[from] MapError),
}

impl FromStr for Grid {
    type Err = GridError;

    fn from_str(text: &str) -> Result<Self, GridError> {
        if text.eq_ignore_ascii_case("map") {
            return Ok(Self::OfTheMap);
        }
        let mut map = ModeMapConfig::NONE;
        if map.set("map", text) != Some(true) || !map.is_some() {
            return Err(GridError::Unreadable);
        }
        let mut checked = map;
        checked.nodes.fill(MapNode::new(10.0, 0.0));
        ModeMap::new(&checked)?;
        Ok(Self::Given(Box::new(map)))
    }
}

/// Where a node of a map lies, X and Y in mm. Of a single column or row it is the middle.
#[must_use]
pub fn place(map: &ModeMapConfig, node: usize) -> [f64; 2] {
    let columns = usize::from(map.columns).max(1);
    let along = |[first, last]: [f32; 2], nodes: u8, node: usize| {
        let (first, last) = (f64::from(first), f64::from(last));
        let part = match nodes {
            0 | 1 => 0.5,
            _ => node as f64 / f64::from(nodes - 1),
        };
        first + part * (last - first)
    };
    [
        along(map.x_mm, map.columns, node % columns),
        along(map.y_mm, map.rows, node / columns),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_lie_evenly_row_after_row() {
        let Ok(Grid::Given(map)) = "3,2,100,200,-50,70".parse() else {
            panic!("a grid");
        };
        let places: Vec<_> = (0..6).map(|node| place(&map, node)).collect();
        assert_eq!(places[0], [100.0, -50.0]);
        assert_eq!(places[1], [150.0, -50.0]);
        assert_eq!(places[5], [200.0, 70.0]);
        let Ok(Grid::Given(map)) = "1,2,100,200,-50,70".parse() else {
            panic!("a grid");
        };
        assert_eq!(place(&map, 1), [150.0, 70.0]);
        assert_eq!("MAP".parse(), Ok(Grid::OfTheMap));
    }

    #[test]
    fn what_is_no_grid_is_refused() {
        let refused = |text: &str| text.parse::<Grid>().unwrap_err().to_string();
        for text in ["", "0", "3,2,100,200", "3,2,100,200,1,2,3"] {
            assert!(refused(text).contains("COLUMNS,ROWS"), "{text}");
        }
        assert!(refused("9,2,100,200,0,9").contains("a map of 9 by 2"));
        assert!(refused("2,2,200,100,0,9").contains("along X"));
    }
}
