//! The whole product from outside: its binary, its processes, its promises.

mod architecture;
mod backtest;
mod chaos;
mod circles;
mod command_line;
mod compose;
mod demo;
mod docs;
mod due;
mod durability;
mod files;
mod flown_lives;
mod in_process;
mod loads;
mod matrix;
mod operations;
mod order;
mod outages;
mod own_diagnoses;
mod own_fleet;
mod processes;
mod recorded_lives;
mod simulation;
mod token;
mod upkeep;
mod what_if;
