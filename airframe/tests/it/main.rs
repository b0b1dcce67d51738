//! What the airframe promises: wing, gratings, loads, flights.

mod cases;
mod fbg;
mod flight;
mod glue;
mod lifting_line;
mod load_estimate;
mod load_estimator;
mod load_goals;
mod map_fit;
mod wing;
