//! From the history of fault vectors to remaining useful life with uncertainty.

pub mod boundary;
