//! A life of a component before its present one.

use askama::Template;
use store::Installed;

use super::{course::Course, record::Record};

/// The page of an earlier life.
#[derive(Template)]
#[template(path = "earlier.html")]
pub struct EarlierPage {
    tail: String,
    position: String,
    part_number: String,
    serial_number: String,
    course: Course,
    record: Record,
    advisory: &'static str,
}

impl EarlierPage {
    /// The page of a life of what is installed somewhere; the record says which life is shown.
    pub fn new(installed: Installed, course: Course, record: Record) -> Self {
        Self {
            tail: installed.tail.into(),
            position: installed.position.into(),
            part_number: installed.part_number.into(),
            serial_number: installed.serial_number.into(),
            course,
            record,
            advisory: domain::ADVISORY,
        }
    }
}
