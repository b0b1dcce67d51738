//! The server as its callers see it: real connections, a real database.

mod answers;
mod bad_input;
mod house;
mod interface;
mod pages;
mod stop;
mod uploads;
