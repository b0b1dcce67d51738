//! Uplink frames from the aircraft to the forecast: what their steps cost, and the whole way through real processes.

mod quantised;
mod service;
