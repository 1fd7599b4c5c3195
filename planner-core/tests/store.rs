//! Power cuts and damage: what the store holds afterwards.

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use planner_core::protocol::{RECORD_BYTES, Record};
use planner_core::store::{BUFFER_BYTES, Store};
use proptest::prelude::*;

const PAGE: usize = 2048;
const PAGES: usize = 4;
const WORD: usize = 8;

/// A NOR flash as in the STM32G4: 8-byte words, 2 KiB pages. A word is written once, and once
/// more if that makes it zero (RM0440, PROGERR of the flash's status register).
#[derive(Clone)]
struct Flash {
    bytes: Vec<u8>,
    /// Words written and pages erased until the power fails; none: it does not.
    power: Option<u32>,
    /// How much of what is under way then takes place, in 1/256.
    torn: u8,
    /// Words written and pages erased so far.
    steps: u32,
}

#[derive(Debug)]
struct NoPower;

impl NorFlashError for NoPower {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl Flash {
    fn new() -> Self {
        Self {
            bytes: vec![0xFF; PAGE * PAGES],
            power: None,
            torn: 0,
            steps: 0,
        }
    }

    /// One step: whether it takes place as a whole; `Err` if the power is gone already.
    fn step(&mut self) -> Result<bool, NoPower> {
        self.steps += 1;
        match &mut self.power {
            None => Ok(true),
            Some(0) => Err(NoPower),
            Some(left) => {
                *left -= 1;
                Ok(*left > 0)
            }
        }
    }
}

impl ErrorType for Flash {
    type Error = NoPower;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NoPower> {
        let offset = offset as usize;
        bytes.copy_from_slice(&self.bytes[offset..offset + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NoPower> {
        for page in (from as usize..to as usize).step_by(PAGE) {
            let whole = self.step()?;
            let length = if whole {
                PAGE
            } else {
                PAGE * usize::from(self.torn) / 256
            };
            self.bytes[page..page + length].fill(0xFF);
            if !whole {
                return Err(NoPower);
            }
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NoPower> {
        assert!((offset as usize).is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD));
        for (i, word) in bytes.chunks(WORD).enumerate() {
            let whole = self.step()?;
            let at = offset as usize + i * WORD;
            let place = &mut self.bytes[at..at + WORD];
            assert!(
                place.iter().all(|byte| *byte == 0xFF) || word.iter().all(|byte| *byte == 0),
                "a word is written twice"
            );
            let length = if whole {
                WORD
            } else {
                usize::from(self.torn) % (WORD + 1)
            };
            place[..length].copy_from_slice(&word[..length]);
            if !whole {
                return Err(NoPower);
            }
        }
        Ok(())
    }
}

fn store(flash: Flash) -> Store<Flash> {
    Store::new(flash, 0..(PAGE * PAGES) as u32).expect("the range is whole pages")
}

fn load(store: &mut Store<Flash>, record: Record) -> Option<Vec<u8>> {
    let mut buffer = [0; BUFFER_BYTES];
    let value = block_on(store.load(record, &mut buffer));
    value.expect("the store is in order").map(<[u8]>::to_vec)
}

/// A random generator that needs no crate.
struct Random(u64);

impl Random {
    fn next(&mut self, below: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % below
    }
}

/// Random updates; at each of their steps the power fails once. Returns the number of cuts.
fn cut_everywhere(updates: u32, seed: u64) -> u64 {
    let mut random = Random(seed);
    let mut flash = Flash::new();
    let mut values: [Option<Vec<u8>>; Record::ALL.len()] = Default::default();
    let mut cuts = 0;
    for update in 0..updates {
        let which = random.next(Record::ALL.len());
        let length = random.next(RECORD_BYTES + 1);
        let value: Vec<u8> = (0..length).map(|_| random.next(256) as u8).collect();
        let mut after = None;
        for power in 1.. {
            let mut cut = flash.clone();
            cut.power = Some(power);
            cut.torn = random.next(256) as u8;
            let mut store = store(cut);
            let mut buffer = [0; BUFFER_BYTES];
            let saved = block_on(store.save(Record::ALL[which], &value, &mut buffer));
            let mut image = store.into_flash();
            let had_power = image.power != Some(0);
            image.power = None;
            // What a start after the cut finds.
            let mut restarted = self::store(image);
            for (i, record) in Record::ALL.into_iter().enumerate() {
                let found = load(&mut restarted, record);
                if i == which {
                    let is_new = found.as_ref() == Some(&value);
                    let is_old = found == values[i];
                    assert!(is_new || is_old, "update {update}, cut at step {power}");
                    assert!(is_new || saved.is_err(), "update {update} was lost");
                } else {
                    assert_eq!(found, values[i], "update {update}, cut at step {power}");
                }
            }
            let image = restarted.into_flash();
            if had_power {
                flash = image;
                values[which] = Some(value);
                break;
            }
            cuts += 1;
            // Go on from one of the cuts, now and then.
            if random.next(4) == 0 {
                after = Some(image);
            }
        }
        if random.next(3) == 0
            && let Some(image) = after
        {
            let mut restarted = store(image);
            values[which] = load(&mut restarted, Record::ALL[which]);
            flash = restarted.into_flash();
        }
    }
    cuts
}

#[test]
fn a_power_cut_at_any_write_leaves_the_old_value_or_the_new_one() {
    let cuts = cut_everywhere(300, 0x9E37_79B9_7F4A_7C15);
    assert!(cuts > 3000, "{cuts}");
}

#[test]
#[ignore = "ten thousand updates: a minute"]
fn ten_thousand_updates_with_a_power_cut_at_every_write() {
    let cuts = cut_everywhere(10_000, 0x2545_F491_4F6C_DD1D);
    println!("{cuts} power cuts");
}

#[test]
fn a_new_flash_holds_nothing_and_an_erased_one_too() {
    let mut store = store(Flash::new());
    assert_eq!(load(&mut store, Record::Settings), None);
    let mut buffer = [0; BUFFER_BYTES];
    block_on(store.save(Record::Settings, &[1, 2, 3], &mut buffer)).unwrap();
    assert_eq!(load(&mut store, Record::Settings), Some(vec![1, 2, 3]));
    block_on(store.erase()).unwrap();
    assert_eq!(load(&mut store, Record::Settings), None);
}

#[test]
fn a_range_that_is_no_whole_pages_is_refused() {
    assert!(Store::new(Flash::new(), 0..PAGE as u32).is_none());
    assert!(Store::new(Flash::new(), 8..4096).is_none());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever the flash holds, nothing panics or hangs, and after an erase it is a store.
    #[test]
    fn damage_is_found_or_harmless(
        damage in proptest::collection::vec((0..PAGE * PAGES, any::<u8>()), 0..200),
        garbage in proptest::option::of(any::<[u8; 32]>()),
    ) {
        let value: Vec<u8> = (0..200).collect();
        let mut healthy = store(Flash::new());
        let mut buffer = [0; BUFFER_BYTES];
        block_on(healthy.save(Record::Settings, &value, &mut buffer)).unwrap();
        let mut flash = healthy.into_flash();
        if let Some(garbage) = garbage {
            for (i, byte) in flash.bytes.iter_mut().enumerate() {
                *byte = garbage[i % garbage.len()];
            }
        }
        for (at, byte) in damage {
            flash.bytes[at] = byte;
        }
        let mut store = store(flash);
        if let Ok(Some(found)) = block_on(store.load(Record::Settings, &mut buffer)) {
            prop_assert_eq!(found, &value[..]);
        }
        block_on(store.erase()).unwrap();
        block_on(store.save(Record::Offsets, &value, &mut buffer)).unwrap();
        prop_assert_eq!(load(&mut store, Record::Offsets), Some(value));
    }
}
