//! From an upload's samples to values of the map that a diagnosis reads, with their noise.
//!
//! Rule: the raw map as it is, or the load-invariant y' = (y + r)/(1 + r); a noise SD on y is SD/(1 + r)
//! on y'. What the model does not explain, the floor, adds to the variance of every value.

use domain::LoadRatio;
use reduction::{Sample, load_invariant};
use serde::{Deserialize, Serialize};

/// A point whose 1 + r is below this carries next to no information on the load-invariant map.
const SMALLEST_LOAD_GAIN: f64 = 0.25;

/// Which map a diagnoser reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MapKind {
    /// y' = (y + r)/(1 + r): the upload gives the load ratio.
    #[serde(alias = "load-invariant")]
    LoadInvariant,
    /// The raw map y: the load is unknown, and trained as a nuisance.
    Raw,
}

/// What one upload measured at the points of a mask.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement<'a> {
    /// Back-EMF samples in units of k_nom, in the mask's order; `None` where no pass gave a value.
    pub samples: &'a [Option<f64>],
    /// Load ratio; a load-invariant diagnosis needs it, a raw one ignores it.
    pub load_ratio: Option<&'a LoadRatio>,
    /// Standard deviation of a sample in units of k_nom, where the upload states it.
    pub noise: Option<f64>,
}

/// How samples become values of a map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MapReader {
    /// Which map.
    pub kind: MapKind,
    /// Standard deviation of a sample in training, units of k_nom: assumed where an upload states none.
    pub noise: f64,
    /// Standard deviation of a value that the basis does not explain, units of k_nom.
    pub floor: f64,
    /// What a mean load ratio is short of the mean of the points' ratios: it weights passes by
    /// their speed, they do not, and friction counts for less in fast passes.
    pub mean_load_offset: f64,
}

/// Values of the map at the mask's points.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Value and standard deviation of each point; `None` where there is nothing to use.
    pub samples: Vec<Option<Sample>>,
    /// Factor from the eccentricity that the map shows to the true one: 1 + mean r, or one for a raw map.
    pub pair_gain: f64,
}

impl MapReader {
    /// The values of a measurement.
    ///
    /// # Panics
    /// If the load ratio is missing where the map needs it, or load ratios are not as many as samples.
    pub fn read(&self, measurement: &Measurement) -> Reading {
        let noise = measurement.noise.unwrap_or(self.noise);
        match self.kind {
            MapKind::Raw => {
                let samples = measurement.samples.iter().map(|y| y.map(|y| self.sample(y, noise))).collect();
                Reading { samples, pair_gain: 1.0 }
            }
            MapKind::LoadInvariant => self.read_load_invariant(measurement, noise),
        }
    }

    fn read_load_invariant(&self, measurement: &Measurement, noise: f64) -> Reading {
        let ratios = self.load_ratios(measurement);
        assert_eq!(ratios.len(), measurement.samples.len(), "load ratios of another mask");
        let (mut sum, mut count) = (0.0, 0.0);
        let at = |(y, r): (&Option<f64>, Option<f64>)| {
            let (y, r) = ((*y)?, r.filter(|r| 1.0 + r >= SMALLEST_LOAD_GAIN)?);
            sum += r;
            count += 1.0;
            Some(self.sample(load_invariant::from_raw(y, r), noise / (1.0 + r)))
        };
        let samples = measurement.samples.iter().zip(ratios).map(at).collect();
        Reading { samples, pair_gain: if count > 0.0 { 1.0 + sum / count } else { 1.0 } }
    }

    fn sample(&self, value: f64, noise: f64) -> Sample {
        Sample { value, sd: (noise * noise + self.floor * self.floor).sqrt() }
    }

    /// The load ratio at each point; a mean serves all of them.
    fn load_ratios(&self, measurement: &Measurement) -> Vec<Option<f64>> {
        match measurement.load_ratio.expect("a load-invariant diagnosis needs the load ratio") {
            LoadRatio::Mean(r) => vec![Some(r + self.mean_load_offset); measurement.samples.len()],
            LoadRatio::PerSample(ratios) => ratios.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reader(kind: MapKind) -> MapReader {
        MapReader { kind, noise: 0.01, floor: 0.0, mean_load_offset: 0.02 }
    }

    #[test]
    fn noise_shrinks_and_eccentricity_grows_with_the_load() {
        let ratio = LoadRatio::PerSample(vec![Some(0.25), None, Some(0.75)]);
        let samples = [Some(0.9), None, Some(1.0)];
        let measurement = Measurement { samples: &samples, load_ratio: Some(&ratio), noise: Some(0.02) };
        let reading = reader(MapKind::LoadInvariant).read(&measurement);
        let first = reading.samples[0].unwrap();
        assert!((first.value - 1.15 / 1.25).abs() < 1e-15 && (first.sd - 0.016).abs() < 1e-15);
        assert_eq!(reading.samples[1], None);
        assert_eq!(reading.pair_gain, 1.5);
        let raw = reader(MapKind::Raw).read(&measurement);
        assert_eq!((raw.samples[0].unwrap().value, raw.pair_gain), (0.9, 1.0));
    }

    #[test]
    fn a_mean_is_corrected_and_points_that_hardly_turn_the_motor_are_left_out() {
        let measure = |r| LoadRatio::Mean(r);
        let read = |ratio: &LoadRatio| {
            let measurement = Measurement { samples: &[Some(0.5), Some(0.6)], load_ratio: Some(ratio), noise: None };
            reader(MapKind::LoadInvariant).read(&measurement)
        };
        let reading = read(&measure(0.48));
        assert!((reading.pair_gain - 1.5).abs() < 1e-15);
        assert!((reading.samples[0].unwrap().sd - 0.01 / 1.5).abs() < 1e-15);
        assert_eq!(read(&measure(-0.9)).samples, [None, None]);
    }
}
