//! What is told of the flights to come: how hard and how warm a tail will fly.

/// Stretches of flying, in ascending order; what none of them tells is expected to go on as the life so far lets one expect.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ahead {
    /// The stretches.
    pub stretches: Vec<Stretch>,
}

/// A stretch of flying, until the next one begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// When it begins, flight hours from the newest data; zero or more.
    pub from_fh: f64,
    /// Its load, where that is told.
    pub load: Option<LoadAhead>,
    /// Its temperature, where that is told.
    pub temperature: Option<TemperatureAhead>,
}

/// A load to come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LoadAhead {
    /// So many times that of now.
    Times(f64),
    /// abs(M_h) over the reference moment of the surface.
    Ratio(f64),
}

/// An ambient temperature to come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TemperatureAhead {
    /// So many kelvin above that of now.
    Above(f64),
    /// Degrees Celsius.
    Celsius(f64),
}

impl Ahead {
    /// Whether nothing is told.
    pub fn is_silent(&self) -> bool {
        self.stretches.iter().all(|stretch| stretch.load.is_none() && stretch.temperature.is_none())
    }
}
