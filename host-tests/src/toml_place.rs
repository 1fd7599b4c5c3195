//! Where a key stands in a TOML text: what an error has to say.

use toml::de::{DeTable, DeValue};

/// Line of a byte, from 1.
#[must_use]
pub fn line_at(text: &str, offset: usize) -> usize {
    let before = text.as_bytes().iter().take(offset);
    before.filter(|&&byte| byte == b'\n').count() + 1
}

/// Line of a dotted key, or of its table's first key; none if it is not there.
#[must_use]
pub fn line_of(text: &str, dotted: &str) -> Option<usize> {
    let root = DeTable::parse(text).ok()?;
    let mut table = root.get_ref();
    let mut offset = None;
    for part in dotted.split('.') {
        let (key, value) = table.iter().find(|(key, _)| key.get_ref() == part)?;
        offset = Some(key.span().start);
        if let DeValue::Table(inner) = value.get_ref() {
            table = inner;
        }
    }
    offset.map(|offset| line_at(text, offset))
}

/// The dotted key whose name or value covers a byte; none if the text is no TOML.
#[must_use]
pub fn key_at(text: &str, offset: usize) -> Option<String> {
    let root = DeTable::parse(text).ok()?;
    find(root.get_ref(), offset)
}

fn find(table: &DeTable<'_>, offset: usize) -> Option<String> {
    table.iter().find_map(|(key, value)| {
        let name = key.get_ref();
        if let DeValue::Table(inner) = value.get_ref()
            && let Some(deeper) = find(inner, offset)
        {
            return Some(format!("{name}.{deeper}"));
        }
        let covers = key.span().contains(&offset) || value.span().contains(&offset);
        covers.then(|| name.to_string())
    })
}
