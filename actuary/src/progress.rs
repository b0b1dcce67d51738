//! Progress of long work on standard error: one bar per stage.

use indicatif::{ProgressBar, ProgressStyle};
use pipeline::Progress;

/// The bar of the stage under way; it disappears with its owner.
pub struct Bar(ProgressBar);

impl Bar {
    /// Without a stage yet.
    pub fn new() -> Self {
        let style = ProgressStyle::with_template("{msg:<32} {wide_bar} {pos}/{len} {eta}").expect("a valid template");
        Self(ProgressBar::new(0).with_style(style))
    }
}

impl Progress for Bar {
    fn stage(&self, name: &'static str, steps: usize) {
        self.0.reset();
        self.0.set_length(steps as u64);
        self.0.set_message(name);
    }

    fn step(&self) {
        self.0.inc(1);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
