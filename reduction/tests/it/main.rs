//! What the reduction promises, against golden values.

mod gappy;
mod golden;
