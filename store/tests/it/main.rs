//! What the store promises, on both databases and on each of them.

mod conformance;
mod fixture;
mod postgres;
mod rooms;
mod sqlite;
mod walls;
