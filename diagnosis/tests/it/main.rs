//! What the diagnosis promises, against golden values and on the data folder.

mod common;
mod diagnoser;
mod figures;
mod golden;
