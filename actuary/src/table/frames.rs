//! Uplink frames and their keys for people.

use std::fmt::Write;

use domain::FrameSubject;
use proto::frame::Row;
use store::FrameKeyRecord;

use super::minute;

/// One line per key.
pub fn frame_keys(keys: &[FrameKeyRecord]) -> String {
    let mut table = String::new();
    line(&mut table, ["id", "made", "revoked", "speaks for"].map(str::to_owned));
    for key in keys {
        let revoked = key.revoked_at.map_or_else(|| "-".to_owned(), minute);
        line(&mut table, [key.id.to_string(), minute(key.made_at), revoked, subject(&key.subject)]);
    }
    table
}

fn line(table: &mut String, [id, made, revoked, subject]: [String; 4]) {
    writeln!(table, "{id:<16}  {made:<17}  {revoked:<17}  {subject}").expect("writing to a string");
}

/// Whom a key speaks for, in words.
pub fn subject(subject: &FrameSubject) -> String {
    match subject {
        FrameSubject::Actuator { tail, position, part_number, serial_number, mask_id: _ } => {
            format!("{part_number} {serial_number} at {position} of {tail}")
        }
        FrameSubject::Strain { tail } => format!("the strain of {tail}"),
    }
}

/// One line per field of a frame.
pub fn frame(rows: &[Row]) -> String {
    let mut table = String::from("byte  bytes  field                                value\n");
    for Row { at, width, field, value } in rows {
        writeln!(table, "{at:>4}  {width:>5}  {field:<35}  {value}").expect("writing to a string");
    }
    table
}
