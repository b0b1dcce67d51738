//! Lists of numbers in whole steps of a power of two that suits the greatest of them.
//!
//! value = code x 2^exponent, with the least exponent by which every code fits; the lowest code means that there is no value.
//! So a step is at most 1/64 (8 bits) or 1/1024 (12 bits) of the greatest value, whatever the motor.

use std::ops::RangeInclusive;

use domain::Invalid;

/// The exponents of samples, V s/rad.
pub(super) const SAMPLE_EXPONENTS: RangeInclusive<i32> = -40..=4;
/// The exponents of load ratios.
pub(super) const RATIO_EXPONENTS: RangeInclusive<i32> = -15..=0;
/// The greatest code of 12 bits.
pub(super) const SAMPLE_CODES: i32 = 2_047;
/// The greatest code of 8 bits.
pub(super) const RATIO_CODES: i32 = 127;

/// Two to the power of an exponent.
pub(super) fn step(exponent: i32) -> f64 {
    2_f64.powi(exponent)
}

/// The least exponent by which all values have codes up to `most`; values that have none are noted, and left out.
pub(super) fn exponent(
    values: &[Option<f64>],
    most: i32,
    exponents: RangeInclusive<i32>,
    pointer: &str,
    invalid: &mut Invalid,
) -> i32 {
    let (mut exponent, last) = exponents.into_inner();
    for (i, value) in values.iter().enumerate().filter_map(|(i, value)| value.map(|value| (i, value))) {
        let fits = |exponent: i32| (value / step(exponent)).round().abs() <= f64::from(most);
        match (exponent..=last).find(|exponent| fits(*exponent)) {
            Some(fitting) => exponent = fitting,
            None => {
                let greatest = f64::from(most) * step(last);
                invalid.push(format!("{pointer}/{i}"), format!("{value} is outside {} to {greatest}", -greatest));
            }
        }
    }
    exponent
}

/// The code of a value that fits; `-most - 1` for none.
pub(super) fn code(value: Option<f64>, exponent: i32, most: i32) -> i32 {
    // What does not fit was noted before; it only has to be some code.
    value.map_or(-most - 1, |value| (value / step(exponent)).round().clamp(f64::from(-most), f64::from(most)) as i32)
}

/// The value of a code.
pub(super) fn value(code: i32, exponent: i32, most: i32) -> Option<f64> {
    (code >= -most).then(|| f64::from(code) * step(exponent))
}

/// Bytes of so many codes of 12 bits.
pub(super) const fn packed_length(count: usize) -> usize {
    (12 * count).div_ceil(8)
}

/// Codes of 12 bits one behind the other, the greatest bits first; what is left of the last byte is zero.
pub(super) fn pack(frame: &mut Vec<u8>, codes: impl Iterator<Item = i32>) {
    let mut left: Option<u8> = None;
    for code in codes {
        let bits = (code & 0xfff) as u16;
        left = match left {
            None => {
                frame.push((bits >> 4) as u8);
                Some((bits << 4) as u8)
            }
            Some(high) => {
                frame.extend_from_slice(&[high | (bits >> 8) as u8, bits as u8]);
                None
            }
        };
    }
    frame.extend(left);
}

/// The codes in these bytes, signed.
pub(super) fn unpack(bytes: &[u8], count: usize) -> Vec<i32> {
    let code = |i: usize| {
        let at = 3 * i / 2;
        let bits = u16::from_be_bytes([bytes[at], bytes[at + 1]]);
        let bits = if i.is_multiple_of(2) { bits >> 4 } else { bits & 0xfff };
        i32::from((bits << 4) as i16 >> 4)
    };
    (0..count).map(code).collect()
}
