//! The model bundle: offline training, and the pure online functions estimate, state and prognosis.
