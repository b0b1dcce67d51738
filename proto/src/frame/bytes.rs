//! Bytes of a frame at their places; places are checked with the frame's length.

/// So many bytes from a place on.
pub(super) fn array<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let mut array = [0; N];
    array.copy_from_slice(&bytes[at..at + N]);
    array
}

/// The unsigned number in these bytes, the greatest first.
pub(super) fn number(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0, |number, byte| number << 8 | u64::from(*byte))
}

/// Appends a number in so many bytes.
pub(super) fn append(frame: &mut Vec<u8>, number: u64, width: usize) {
    frame.extend_from_slice(&number.to_be_bytes()[8 - width..]);
}
