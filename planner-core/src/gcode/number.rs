//! Decimal numbers: read exactly, rounded once, in integer arithmetic only.

use core::fmt;

use crate::units::{AngleDeg, LengthMm};

/// Decimals that a [`Decimal`] keeps. 1e-9 mm is 1900 times finer than a [`LengthMm`].
const DECIMALS: usize = 9;

/// Steps of a [`Decimal`] in one: 10^[`DECIMALS`].
const NANO: i64 = 1_000_000_000;

/// Largest integer part of a number as read.
const MAX_INTEGER: u32 = 999_999_999;

/// The odd factor of 10^9.
const FIVE_TO_THE_NINTH: u32 = 5_u32.pow(9);

/// 10^0 to 10^[`DECIMALS`].
const POWERS_OF_TEN: [u32; DECIMALS + 1] = {
    let mut powers = [1; DECIMALS + 1];
    let mut exponent = 1;
    while exponent <= DECIMALS {
        powers[exponent] = powers[exponent - 1] * 10;
        exponent += 1;
    }
    powers
};

/// Why a text is not a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberError {
    /// Nothing where a number should be.
    Empty,
    /// A sign or a point without any digit.
    NoDigits,
    /// Two signs in a row, as in `--1`.
    SecondSign,
    /// Two decimal points, as in `1.2.3`.
    SecondPoint,
    /// An exponent, as in `1e5`.
    Exponent,
    /// Something else: a letter, a sign after the digits, `nan`, `inf`.
    NotDecimal,
    /// An integer part of more than nine digits, or beyond the target format.
    TooLarge,
}

impl fmt::Display for NumberError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Empty => "the number is missing",
            Self::NoDigits => "the number has no digits",
            Self::SecondSign => "the number has two signs",
            Self::SecondPoint => "the number has two decimal points",
            Self::Exponent => "exponents are not allowed: write the number out",
            Self::NotDecimal => "this is not a decimal number",
            Self::TooLarge => "the number is too large",
        })
    }
}

/// An exact decimal number: ±1e9 as read, ±9.2e9 as computed, resolution 1e-9.
///
/// Up to nine decimals are kept exactly. Further ones round to the nearest 1e-9,
/// a half away from zero; any number of them is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Decimal {
    /// The value in steps of 1e-9.
    nano: i64,
}

impl Decimal {
    /// Zero.
    pub const ZERO: Self = Self { nano: 0 };

    /// `value`, exactly.
    #[must_use]
    pub const fn from_integer(value: i32) -> Self {
        Self {
            nano: value as i64 * NANO,
        }
    }

    /// A number of steps of 1e-9.
    #[must_use]
    pub const fn from_nano(nano: i64) -> Self {
        Self { nano }
    }

    /// The value in steps of 1e-9, exactly.
    #[must_use]
    pub const fn to_nano(self) -> i64 {
        self.nano
    }

    /// Reads a whole text: an optional sign, digits, at most one point.
    ///
    /// # Errors
    /// Any [`NumberError`].
    pub fn parse(text: &[u8]) -> Result<Self, NumberError> {
        match Self::parse_prefix(text)? {
            (value, []) => Ok(value),
            (_, [b'.', ..]) => Err(NumberError::SecondPoint),
            (_, [b'e' | b'E', ..]) => Err(NumberError::Exponent),
            _ => Err(NumberError::NotDecimal),
        }
    }

    /// Reads the number at the start of a text and returns what follows it.
    ///
    /// # Errors
    /// Any [`NumberError`] but [`NumberError::SecondPoint`] and
    /// [`NumberError::Exponent`], which lie in what follows.
    pub fn parse_prefix(text: &[u8]) -> Result<(Self, &[u8]), NumberError> {
        let (negative, text) = match text {
            [] => return Err(NumberError::Empty),
            [b'-', digits @ ..] => (true, digits),
            [b'+', digits @ ..] => (false, digits),
            digits => (false, digits),
        };
        match text.first() {
            Some(b'0'..=b'9' | b'.') => {}
            Some(b'+' | b'-') => return Err(NumberError::SecondSign),
            Some(_) => return Err(NumberError::NotDecimal),
            None => return Err(NumberError::NoDigits),
        }
        let (integer, after) = parse_integer(text)?;
        let mut digits = text.len() - after.len();
        let (fraction, rest) = match after {
            [b'.', decimals @ ..] => {
                let (fraction, rest) = parse_fraction(decimals);
                digits += decimals.len() - rest.len();
                (fraction, rest)
            }
            _ => (0, after),
        };
        if digits == 0 {
            return Err(NumberError::NoDigits);
        }
        let nano = i64::from(integer) * NANO + i64::from(fraction);
        let nano = if negative { -nano } else { nano };
        Ok((Self { nano }, rest))
    }

    /// The integer part: the decimals are cut off.
    #[must_use]
    pub const fn integer(self) -> i64 {
        self.truncated(0)
    }

    /// The nearest integer, a half away from zero.
    #[must_use]
    pub const fn rounded(self) -> i64 {
        self.truncated(NANO.unsigned_abs() / 2)
    }

    /// The integer part of a value whose magnitude is greater by `more_nano`.
    const fn truncated(self, more_nano: u64) -> i64 {
        let magnitude = self.nano.unsigned_abs().saturating_add(more_nano);
        // 10^9 = 2^9 · 5^9
        let (quotient, _) = divide::<FIVE_TO_THE_NINTH>(magnitude >> 9);
        self.with_sign(quotient)
    }

    /// Ten times the value if that is a whole number of 0 to 9999: 382 for the 38.2 of G38.2.
    #[must_use]
    pub const fn tenths(self) -> Option<u16> {
        // A tenth is 2^8 · 5^8 steps.
        const ODD: u32 = 5_u32.pow(8);
        if self.nano < 0 || self.nano & 0xFF != 0 || self.nano >= 10_000 * (NANO / 10) {
            return None;
        }
        let odd = (self.nano >> 8) as u32;
        if odd.is_multiple_of(ODD) {
            Some((odd / ODD) as u16)
        } else {
            None
        }
    }

    /// Millimetres of a value in inches, rounded to 1e-9 mm: exact up to eight decimals.
    ///
    /// # Errors
    /// [`NumberError::TooLarge`] beyond ±7.2e7 in.
    pub fn inches_to_mm(self) -> Result<Self, NumberError> {
        let nano = self.nano.checked_mul(127).ok_or(NumberError::TooLarge)?;
        let (quotient, _) = divide::<5>(nano.unsigned_abs() + 2);
        Ok(Self {
            nano: self.with_sign(quotient),
        })
    }

    /// The nearest length, for a value in millimetres (there are no ties).
    ///
    /// # Errors
    /// [`NumberError::TooLarge`] outside of the format's ±4096 mm.
    pub fn to_length_mm(self) -> Result<LengthMm, NumberError> {
        // 2^19 / 10^9 = 2^10 / 5^9
        let scaled = self.nano.checked_mul(1 << 10);
        let magnitude = scaled.ok_or(NumberError::TooLarge)?.unsigned_abs();
        let half = u64::from(FIVE_TO_THE_NINTH / 2);
        let (quotient, _) = divide::<FIVE_TO_THE_NINTH>(magnitude + half);
        let bits = self.with_sign(quotient);
        match i32::try_from(bits) {
            Ok(bits) => Ok(LengthMm::from_bits(bits)),
            Err(_) => Err(NumberError::TooLarge),
        }
    }

    /// The nearest angle, for a value in degrees (there are no ties).
    ///
    /// # Errors
    /// [`NumberError::TooLarge`] outside of the format's ±4096°.
    pub fn to_angle_deg(self) -> Result<AngleDeg, NumberError> {
        let same_format: AngleDeg = self.to_length_mm()?;
        Ok(same_format)
    }

    /// Millimetres of a length, to 1e-9; [`Decimal::to_length_mm`] gives its bits back.
    #[must_use]
    pub fn from_length_mm(length: LengthMm) -> Self {
        Self {
            nano: divide_rounded(
                i64::from(length.to_bits()) * i64::from(FIVE_TO_THE_NINTH),
                1 << 10,
            ),
        }
    }

    /// The nearest `f32`, ties to even.
    #[must_use]
    pub fn to_f32(self) -> f32 {
        self.to_f32_over::<1>(0)
    }

    /// A 60th of the value, the nearest `f32`: per second from per minute.
    #[must_use]
    pub fn per_minute_to_f32(self) -> f32 {
        self.to_f32_over::<15>(2)
    }

    /// The `f32` nearest to the value / (`D` · 2^`twos`), ties to even.
    fn to_f32_over<const D: u32>(self, twos: u32) -> f32 {
        let magnitude = self.nano.unsigned_abs();
        if magnitude == 0 {
            return 0.0;
        }
        // Shift the top bit to 2^62: the quotient then has 37 bits or more, and what it
        // leaves over is kept as its last bit, so that the conversion rounds but once.
        let shift = magnitude.leading_zeros().saturating_sub(1);
        let (quotient, left) = divide::<FIVE_TO_THE_NINTH>(magnitude << shift);
        let (quotient, left_too) = divide::<D>(quotient);
        let sticky = u64::from(left || left_too);
        let power_of_two = f32::from_bits((127 - 9 - twos - shift) << 23);
        let value = round_to_f32(quotient | sticky) * power_of_two;
        if self.nano < 0 { -value } else { value }
    }

    /// The value as `f64`, within one unit of its last place.
    #[must_use]
    pub fn to_f64(self) -> f64 {
        self.nano as f64 / NANO as f64
    }

    /// A magnitude with the sign of this number.
    const fn with_sign(self, magnitude: u64) -> i64 {
        let value = magnitude.cast_signed();
        if self.nano < 0 { -value } else { value }
    }
}

/// As few characters as needed: `38.2`, `-0.5`, `7`.
impl fmt::Display for Decimal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.nano < 0 { "-" } else { "" };
        let magnitude = self.nano.unsigned_abs();
        write!(f, "{sign}{}", magnitude / NANO.unsigned_abs())?;
        let mut fraction = magnitude % NANO.unsigned_abs();
        if fraction == 0 {
            return Ok(());
        }
        let mut digits = DECIMALS;
        while fraction.is_multiple_of(10) {
            fraction /= 10;
            digits -= 1;
        }
        write!(f, ".{fraction:0digits$}")
    }
}

/// The digits before the point, and what follows them.
fn parse_integer(mut text: &[u8]) -> Result<(u32, &[u8]), NumberError> {
    let mut integer = 0;
    while let [digit @ b'0'..=b'9', rest @ ..] = text {
        if integer > MAX_INTEGER / 10 {
            return Err(NumberError::TooLarge);
        }
        integer = integer * 10 + u32::from(digit - b'0');
        text = rest;
    }
    Ok((integer, text))
}

/// The digits after the point in steps of 1e-9, rounded, and what follows them.
fn parse_fraction(mut text: &[u8]) -> (u32, &[u8]) {
    let mut fraction = 0;
    let mut decimals = 0;
    while let [digit @ b'0'..=b'9', rest @ ..] = text {
        let digit = u32::from(digit - b'0');
        if decimals < DECIMALS {
            fraction = fraction * 10 + digit;
        } else if decimals == DECIMALS {
            fraction += u32::from(digit >= 5);
        }
        decimals += 1;
        text = rest;
    }
    let scale = POWERS_OF_TEN.get(DECIMALS.saturating_sub(decimals));
    (fraction * scale.copied().unwrap_or(1), text)
}

/// `numerator / D`, and whether anything is left; `D` is below 2^24.
///
/// A long division with digits of eight bits: the Cortex-M4 divides 32 bits in hardware,
/// and 64 bits in a library that takes several times as long.
const fn divide<const D: u32>(numerator: u64) -> (u64, bool) {
    const { assert!(D > 0 && D < 1 << 24) };
    let high = (numerator >> 32) as u32;
    let mut remainder = high % D;
    let mut low_quotient = 0_u32;
    let mut low = numerator as u32;
    let mut digits = 4;
    while digits > 0 {
        let part = (remainder << 8) | (low >> 24);
        low_quotient = (low_quotient << 8) | (part / D);
        remainder = part % D;
        low <<= 8;
        digits -= 1;
    }
    (
        ((high / D) as u64) << 32 | low_quotient as u64,
        remainder != 0,
    )
}

/// The nearest `f32` to an integer below 2^62, ties to even.
fn round_to_f32(value: u64) -> f32 {
    // The upper bits, and whether the lower ones matter: `value as f32` takes a
    // library for 64 bits, and one instruction for 32.
    let shift = 32_u32.saturating_sub(value.leading_zeros());
    let upper = (value >> shift) as u32;
    let sticky = u32::from((u64::from(upper) << shift) != value);
    (upper | sticky) as f32 * f32::from_bits((127 + shift) << 23)
}

/// `numerator / denominator` to the nearest integer, a half away from zero.
/// The denominator is positive.
const fn divide_rounded(numerator: i64, denominator: i64) -> i64 {
    let half = if numerator < 0 {
        -(denominator / 2)
    } else {
        denominator / 2
    };
    numerator.saturating_add(half) / denominator
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::format;

    use proptest::prelude::*;

    use super::*;

    #[test]
    fn numbers_read_exactly() {
        for (text, nano) in [
            ("0", 0),
            ("-0", 0),
            ("10", 10_000_000_000),
            ("+1", 1_000_000_000),
            (".5", 500_000_000),
            ("-.5", -500_000_000),
            ("5.", 5_000_000_000),
            ("0.000000001", 1),
            ("000000000000000012", 12_000_000_000),
            ("999999999.999999999", 999_999_999_999_999_999),
            // Ten digits and more round, a half away from zero.
            ("0.0000000014999999999999999999", 1),
            ("0.0000000015", 2),
            ("-0.0000000015", -2),
            ("0.99999999999999999999999", 1_000_000_000),
        ] {
            assert_eq!(
                Decimal::parse(text.as_bytes()),
                Ok(Decimal::from_nano(nano)),
                "{text}"
            );
        }
    }

    #[test]
    fn what_is_no_number_is_named() {
        for (text, error) in [
            ("", NumberError::Empty),
            ("-", NumberError::NoDigits),
            (".", NumberError::NoDigits),
            ("+.", NumberError::NoDigits),
            ("--1", NumberError::SecondSign),
            ("-+1", NumberError::SecondSign),
            ("1.2.3", NumberError::SecondPoint),
            ("1e5", NumberError::Exponent),
            ("1E-5", NumberError::Exponent),
            ("NaN", NumberError::NotDecimal),
            ("-inf", NumberError::NotDecimal),
            ("1-", NumberError::NotDecimal),
            ("0x10", NumberError::NotDecimal),
            ("1000000000", NumberError::TooLarge),
            ("99999999999999999999999999", NumberError::TooLarge),
        ] {
            assert_eq!(Decimal::parse(text.as_bytes()), Err(error), "{text}");
        }
    }

    #[test]
    fn lengths_round_to_nearest_and_end_at_4096_mm() {
        let length = |text: &str| Decimal::parse(text.as_bytes()).and_then(Decimal::to_length_mm);
        assert_eq!(length("1").map(LengthMm::to_bits), Ok(1 << 19));
        assert_eq!(length("0.1").map(LengthMm::to_bits), Ok(52_429)); // 52428.8
        assert_eq!(length("-0.1").map(LengthMm::to_bits), Ok(-52_429));
        assert_eq!(length("-4096").map(LengthMm::to_bits), Ok(i32::MIN));
        assert_eq!(length("4096"), Err(NumberError::TooLarge));
        assert_eq!(length("999999999"), Err(NumberError::TooLarge));
        let inch = |text: &str| Decimal::parse(text.as_bytes()).and_then(Decimal::inches_to_mm);
        assert_eq!(inch("1"), Decimal::parse(b"25.4"));
        assert_eq!(inch("-0.12345678"), Decimal::parse(b"-3.135802212"));
        assert_eq!(inch("99999999"), Err(NumberError::TooLarge));
    }

    proptest! {
        #[test]
        fn a_formatted_number_reads_back(nano in -999_999_999_999_999_999_i64..=999_999_999_999_999_999) {
            let value = Decimal::from_nano(nano);
            prop_assert_eq!(Decimal::parse(format!("{value}").as_bytes()), Ok(value));
        }

        #[test]
        fn a_length_reads_back(bits: i32) {
            let length = LengthMm::from_bits(bits);
            prop_assert_eq!(Decimal::from_length_mm(length).to_length_mm(), Ok(length));
        }

        /// The standard library's reading of the same text is the oracle.
        #[test]
        fn f32_is_the_nearest(nano in -1_000_000_000_000_000_000_i64..=1_000_000_000_000_000_000, shift in 0..60) {
            let value = Decimal::from_nano(nano >> shift);
            let oracle: f32 = format!("{value}").parse().unwrap();
            prop_assert_eq!(value.to_f32(), oracle);
            let oracle: f64 = format!("{value}").parse().unwrap();
            prop_assert!((value.to_f64() - oracle).abs() <= oracle.abs() * 2.3e-16);
            // 60 · nearest is within half a unit of the last place, 2^-24, of the value.
            let per_minute = f64::from(value.per_minute_to_f32()) * 60.0;
            prop_assert!((per_minute - oracle).abs() <= oracle.abs() * 5.97e-8, "{value}: {per_minute}");
        }

        #[test]
        fn integers_and_tenths_are_those_of_wide_arithmetic(nano: i64, shift in 0..60) {
            let nano = nano >> shift;
            let value = Decimal::from_nano(nano);
            prop_assert_eq!(value.integer(), nano / NANO);
            let rounded = (i128::from(nano) * 2 + i128::from(NANO) * i128::from(nano.signum())) / i128::from(NANO * 2);
            prop_assert_eq!(i128::from(value.rounded()), rounded);
            let tenth = NANO / 10;
            let whole = nano % tenth == 0 && (0..10_000 * tenth).contains(&nano);
            prop_assert_eq!(value.tenths().is_some(), whole);
        }

        #[test]
        fn tenths_read_back(tenths in 0..10_000_u16) {
            let value = Decimal::from_nano(i64::from(tenths) * (NANO / 10));
            prop_assert_eq!(value.tenths(), Some(tenths));
        }

        #[test]
        fn any_text_is_a_number_or_an_error(text: std::vec::Vec<u8>) {
            let _ = Decimal::parse(&text);
        }

        #[test]
        fn any_digits_are_a_number_or_an_error(text in "[-+]?[0-9.eE]{0,40}") {
            if let Ok(value) = Decimal::parse(text.as_bytes()) {
                let oracle: f64 = text.parse().unwrap();
                prop_assert!((value.to_f64() - oracle).abs() <= 0.5001e-9 + oracle.abs() * 2.3e-16);
                let _ = (value.to_length_mm(), value.to_f32(), value.inches_to_mm());
            }
        }
    }
}
