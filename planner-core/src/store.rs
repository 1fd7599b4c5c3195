//! What outlasts power-off: records in a flash memory.
//!
//! The flash is written round and round by `sequential-storage`; a record is valid once its
//! checksum is. So power may fail at any write: a record then has its old value or its new
//! one, and all others are untouched. A store that is damaged otherwise is erased, and the
//! caller is told.

use core::fmt::Debug;
use core::ops::Range;

use embedded_storage_async::nor_flash::NorFlash;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

use crate::protocol::{RECORD_BYTES, Record};

/// Bytes that a store needs while it reads and writes: a record, its key, and what rounding
/// up to the flash's words takes.
pub const BUFFER_BYTES: usize = RECORD_BYTES + 32;

/// Memory that a store works in.
pub type Buffer = [u8; BUFFER_BYTES];

/// The records of a controller in a flash memory.
pub struct Store<F: NorFlash> {
    map: MapStorage<u8, F, Cache<Uncached, Uncached, Uncached, u8>>,
}

/// The flash cannot be read or written, or holds what is no store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Damaged;

/// The record's number in the flash; a number that was ever used keeps its meaning.
const fn key(record: Record) -> u8 {
    match record {
        Record::Settings => 1,
        Record::Offsets => 2,
        Record::BuildName => 3,
        Record::Map => 4,
        Record::Servos => 5,
        Record::StartupLine(line) => 8 + (line & 1),
    }
}

impl<F: NorFlash<Error: Debug>> Store<F> {
    /// A store in a range of a flash: whole pages, two at least.
    ///
    /// `None` if the range is not such.
    pub fn new(flash: F, range: Range<u32>) -> Option<Self> {
        let config = MapConfig::try_new(range).ok()?;
        Some(Self {
            map: MapStorage::new(flash, config, Cache::new_uncached()),
        })
    }

    /// The record's value, if it has ever been saved.
    ///
    /// # Errors
    /// [`Damaged`]: [`Store::erase`] makes it a store again.
    pub async fn load<'b>(
        &mut self,
        record: Record,
        buffer: &'b mut Buffer,
    ) -> Result<Option<&'b [u8]>, Damaged> {
        let value = self.map.fetch_item::<&[u8]>(buffer, &key(record)).await;
        value.map_err(|_| Damaged)
    }

    /// Replaces the record's value.
    ///
    /// # Errors
    /// [`Damaged`]; the record has its old value then, or none any more.
    pub async fn save(
        &mut self,
        record: Record,
        value: &[u8],
        buffer: &mut Buffer,
    ) -> Result<(), Damaged> {
        let saved = self.map.store_item(buffer, &key(record), &value).await;
        saved.map_err(|_| Damaged)
    }

    /// Forgets all records.
    ///
    /// # Errors
    /// [`Damaged`] if the flash does not let itself be erased.
    pub async fn erase(&mut self) -> Result<(), Damaged> {
        self.map.erase_all().await.map_err(|_| Damaged)
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.map.destroy().0
    }
}
