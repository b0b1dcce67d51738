//! What the pipeline promises with the bundle that ships.

mod chains;
mod loads;
mod mutants;
mod outlook;
mod own_diagnosis;
mod own_faults;
mod own_units;
mod paced;
mod rehearsal;
mod training;
