//! The server as its callers see it: real connections, a real database.

mod answers;
mod bad_input;
mod bounds;
mod breaking;
mod broken;
mod callers;
mod components;
mod contract;
mod contradictions;
mod corrections;
mod due;
mod figures;
mod house;
mod interface;
mod log;
mod maintenance;
mod neighbours;
mod own_diagnoses;
mod pages;
mod plans;
mod secrets;
mod stop;
mod stream;
mod tls;
mod uploads;
