//! A map as lines carry it, and as it is kept.
//!
//! ```text
//! map=COLUMNS,ROWS,X0,X1,Y0,Y1        the grid; it is in force when all rows are given
//! map1=HZ/DAMPING,HZ/DAMPING,…        the modes of row 1, that of the lowest Y, from the lowest X
//! map=0                               no map
//! ```

use core::fmt;

use super::map::{MAP_NODES, MapNode, ModeMapConfig};

/// Bytes of a map as it is kept: places, columns, rows, nodes.
pub const MAP_BYTES: usize = 16 + 2 + MAP_NODES * MAP_NODES * MapNode::BYTES;

impl ModeMapConfig {
    /// Sets the grid (`map`) or a row (`map1` and on). Whether a map can be made of it is checked
    /// when one is.
    ///
    /// `None` if the key is none of a map's; `Some(false)` if the value cannot be read, and
    /// nothing is changed then.
    pub fn set(&mut self, key: &str, value: &str) -> Option<bool> {
        let row = key.strip_prefix("map")?;
        let changed = if row.is_empty() {
            grid(value)
        } else {
            self.with_row(row.parse().ok()?, value)
        };
        if let Some(changed) = changed {
            *self = changed;
        }
        Some(changed.is_some())
    }

    fn with_row(mut self, row: usize, text: &str) -> Option<Self> {
        let columns = usize::from(self.columns);
        let first = row
            .checked_sub(1)
            .filter(|_| row <= usize::from(self.rows))?
            * columns;
        let mut places = self.nodes.get_mut(first..first + columns)?.iter_mut();
        for mode in text.split(',') {
            let (frequency, damping) = mode.split_once('/')?;
            *places.next()? = MapNode::new(number(frequency)?, number(damping)?);
        }
        places.next().is_none().then_some(self)
    }

    /// A line that sets it: 0 the grid, then the rows from 1.
    #[must_use]
    pub fn line(&self, line: usize) -> Option<MapLine<'_>> {
        (line == 0 || line <= usize::from(self.rows)).then_some(MapLine { map: self, line })
    }

    /// As kept over a restart, little-endian.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; MAP_BYTES] {
        let mut bytes = [0; MAP_BYTES];
        let ([x0, x1], [y0, y1]) = (self.x_mm, self.y_mm);
        let places = [x0, x1, y0, y1].into_iter().flat_map(f32::to_le_bytes);
        let nodes = self.nodes.iter().flat_map(|node| node.to_bytes());
        let all = places.chain([self.columns, self.rows]).chain(nodes);
        for (byte, value) in bytes.iter_mut().zip(all) {
            *byte = value;
        }
        bytes
    }

    /// The inverse of [`ModeMapConfig::to_bytes`]; `None` if these are no map's bytes.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        if bytes.len() != MAP_BYTES {
            return None;
        }
        let (places, rest) = bytes.split_first_chunk::<16>()?;
        let (&[columns, rows], nodes) = rest.split_first_chunk::<2>()?;
        let mut map = Self {
            columns,
            rows,
            ..Self::NONE
        };
        let [x0, x1] = &mut map.x_mm;
        let [y0, y1] = &mut map.y_mm;
        for (place, chunk) in [x0, x1, y0, y1].into_iter().zip(places.chunks_exact(4)) {
            *place = f32::from_le_bytes(chunk.try_into().ok()?);
        }
        for (node, chunk) in map.nodes.iter_mut().zip(nodes.chunks_exact(MapNode::BYTES)) {
            *node = MapNode::from_bytes(chunk.try_into().ok()?);
        }
        Some(map)
    }
}

/// A line that sets part of a map.
#[derive(Clone, Copy, Debug)]
pub struct MapLine<'a> {
    map: &'a ModeMapConfig,
    line: usize,
}

impl fmt::Display for MapLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ModeMapConfig {
            x_mm: [x0, x1],
            y_mm: [y0, y1],
            columns,
            rows,
            ..
        } = self.map;
        let Some(row) = self.line.checked_sub(1) else {
            return if self.map.is_some() {
                write!(f, "map={columns},{rows},{x0},{x1},{y0},{y1}")
            } else {
                f.write_str("map=0")
            };
        };
        write!(f, "map{}", self.line)?;
        let columns = usize::from(*columns);
        let nodes = self.map.nodes.iter().skip(row * columns).take(columns);
        for (column, node) in nodes.enumerate() {
            let sign = if column == 0 { '=' } else { ',' };
            // as many digits as tell a node from the next one
            write!(f, "{sign}{:.3}/{:.5}", node.frequency_hz(), node.damping())?;
        }
        Ok(())
    }
}

fn grid(text: &str) -> Option<ModeMapConfig> {
    if text == "0" {
        return Some(ModeMapConfig::NONE);
    }
    let mut words = text.split(',');
    let columns = words.next()?.trim().parse().ok()?;
    let rows = words.next()?.trim().parse().ok()?;
    let mut place = || words.next().and_then(number);
    let (x_mm, y_mm) = ([place()?, place()?], [place()?, place()?]);
    words.next().is_none().then_some(ModeMapConfig {
        x_mm,
        y_mm,
        columns,
        rows,
        ..ModeMapConfig::NONE
    })
}

fn number(text: &str) -> Option<f32> {
    text.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn a_map_reads_back_from_its_lines_and_its_bytes() {
        let mut map = ModeMapConfig::NONE;
        assert_eq!(map.set("map", "3,2,100,320.5,-140,140"), Some(true));
        assert_eq!(map.set("map1", "1/0,2/0,3/0.1"), Some(true));
        assert!(map.is_some() && !map.is_complete());
        let row = "8.1/0.02,255/0.5,12.345/0.0123";
        assert_eq!(map.set("map2", row), Some(true));
        assert!(map.is_complete());
        assert_eq!(map.nodes[2], MapNode::new(3.0, 0.1));
        assert_eq!(map.nodes[5], MapNode::new(12.345, 0.0123));
        let mut copy = ModeMapConfig::NONE;
        for line in (0..).map_while(|line| map.line(line)) {
            let text = line.to_string();
            let (key, value) = text.split_once('=').unwrap();
            assert_eq!(copy.set(key, value), Some(true), "{text}");
        }
        assert_eq!(copy, map);
        assert_eq!(ModeMapConfig::from_bytes(&map.to_bytes()), Some(map));
        assert_eq!(map.set("map", "0"), Some(true));
        assert_eq!(map, ModeMapConfig::NONE);
        assert_eq!(map.line(0).unwrap().to_string(), "map=0");
        assert!(map.line(1).is_none());
        assert_eq!(ModeMapConfig::from_bytes(&[7; 3]), None);
    }

    #[test]
    fn what_cannot_be_read_changes_nothing() {
        let mut map = ModeMapConfig::NONE;
        map.set("map", "2,2,0,100,0,100");
        let before = map;
        for (key, value) in [
            ("map", "2,2,0,100,0"),
            ("map", "2,2,0,100,0,100,9"),
            ("map", "-1,2,0,100,0,100"),
            ("map1", "8/0.1"),
            ("map1", "8/0.1,9/0.1,9/0.1"),
            ("map1", "8/0.1,9"),
            ("map3", "8/0.1,9/0.1"),
            ("map0", "8/0.1,9/0.1"),
        ] {
            assert_eq!(map.set(key, value), Some(false), "{key}={value}");
            assert_eq!(map, before);
        }
        assert_eq!(map.set("mapx", "1"), None);
        assert_eq!(map.set("tolerance", "1"), None);
    }
}
