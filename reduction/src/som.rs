//! Self-organising map of the rows of a basis: the thesis's way to the points of a mask.
//!
//! What: neurons on a hexagonal grid, each a representative row [x, v_1..v_m] of angle and mode values.
//! Update rule: rows t in random order, epoch by epoch; the winner l is the neuron nearest to t (2.10), and
//! every neuron j moves by w_j += a h(j, l) (t - w_j) (2.11) with h = exp(-d(j, l)^2 / 2 s^2), d the distance
//! on the grid; rate a and radius s shrink exponentially from the first to the last epoch.
//! Requires: columns on a common scale, so each is standardised; a few hundred rows.
//! Source: Berri 2021, section 2.2.3 and figures 6.5 and 6.6; Kohonen 2001.

#![allow(clippy::disallowed_methods, reason = "offline: a mask is chosen once")]

use numerics::Stream;
use serde::{Deserialize, Serialize};

/// How often every row is shown.
const EPOCHS: usize = 200;
/// Learning rate of the first and the last epoch.
const RATE: [f64; 2] = [0.5, 0.01];
/// Radius of the neighbourhood in the first and the last epoch, in distances of neighbours.
const RADIUS: [f64; 2] = [3.0, 0.5];

/// A trained map, as it is looked at. Neurons are counted row by row; odd rows are shifted by half a neuron.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SelfOrganisingMap {
    /// Rows of neurons.
    pub rows: usize,
    /// Neurons in a row.
    pub columns: usize,
    /// One plane per input, one value per neuron: the angle, rad, and the modes in their order.
    pub component_planes: Vec<Vec<f64>>,
    /// The U-matrix: how far apart neighbours are in the space of standardised inputs.
    pub u_matrix: Vec<NeighbourDistance>,
}

/// One field of the U-matrix.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NeighbourDistance {
    /// Two neighbouring neurons.
    pub neurons: [usize; 2],
    /// Distance of their weights.
    pub distance: f64,
}

impl SelfOrganisingMap {
    /// Learns `inputs`, rows of equal length, on a grid of `rows` by `columns` neurons.
    pub fn train(inputs: &[Vec<f64>], [rows, columns]: [usize; 2], stream: &mut Stream) -> Self {
        let scales: Vec<Scale> =
            (0..inputs[0].len()).map(|j| Scale::of(inputs.iter().map(|row| row[j]), inputs.len())).collect();
        let standardise =
            |row: &Vec<f64>| row.iter().zip(&scales).map(|(x, scale)| (x - scale.mean) / scale.sd).collect();
        let inputs: Vec<Vec<f64>> = inputs.iter().map(standardise).collect();
        let places: Vec<[f64; 2]> = (0..rows * columns).map(|neuron| place(neuron, columns)).collect();
        let weights = learn(&inputs, &places, stream);
        let plane = |(j, scale): (usize, &Scale)| weights.iter().map(|w| scale.mean + scale.sd * w[j]).collect();
        Self {
            rows,
            columns,
            component_planes: scales.iter().enumerate().map(plane).collect(),
            u_matrix: u_matrix(&weights, &places),
        }
    }
}

/// Mean and standard deviation of a column.
struct Scale {
    mean: f64,
    sd: f64,
}

impl Scale {
    fn of(values: impl Iterator<Item = f64> + Clone, count: usize) -> Self {
        let mean = values.clone().sum::<f64>() / count as f64;
        let variance = values.map(|x| (x - mean) * (x - mean)).sum::<f64>() / count as f64;
        Self { mean, sd: if variance > 0.0 { variance.sqrt() } else { 1.0 } }
    }
}

/// The place of a neuron on the grid: neighbours are at distance one.
fn place(neuron: usize, columns: usize) -> [f64; 2] {
    let (row, column) = (neuron / columns, neuron % columns);
    [column as f64 + 0.5 * (row % 2) as f64, row as f64 * 0.75_f64.sqrt()]
}

/// The weights after all epochs; they begin at random rows.
fn learn(inputs: &[Vec<f64>], places: &[[f64; 2]], stream: &mut Stream) -> Vec<Vec<f64>> {
    let mut weights: Vec<Vec<f64>> = places.iter().map(|_| inputs[stream.below(inputs.len())].clone()).collect();
    let mut order: Vec<usize> = (0..inputs.len()).collect();
    for epoch in 0..EPOCHS {
        let way = epoch as f64 / (EPOCHS - 1) as f64;
        let [rate, radius] = [RATE, RADIUS].map(|[first, last]| first * (last / first).powf(way));
        for i in (1..order.len()).rev() {
            order.swap(i, stream.below(i + 1));
        }
        for &i in &order {
            let input = &inputs[i];
            let winner = winner(&weights, input);
            for (weight, place) in weights.iter_mut().zip(places) {
                let pull = rate * (-squared_distance(place, &places[winner]) / (2.0 * radius * radius)).exp();
                weight.iter_mut().zip(input).for_each(|(w, x)| *w += pull * (x - *w));
            }
        }
    }
    weights
}

/// The neuron nearest to an input; the first of equals.
fn winner(weights: &[Vec<f64>], input: &[f64]) -> usize {
    let distances = weights.iter().map(|weight| squared_distance(weight, input));
    distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(neuron, _)| neuron)
}

fn u_matrix(weights: &[Vec<f64>], places: &[[f64; 2]]) -> Vec<NeighbourDistance> {
    let mut distances = Vec::new();
    for a in 0..weights.len() {
        for b in a + 1..weights.len() {
            if squared_distance(&places[a], &places[b]) < 1.5 {
                let distance = squared_distance(&weights[a], &weights[b]).sqrt();
                distances.push(NeighbourDistance { neurons: [a, b], distance });
            }
        }
    }
    distances
}

fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two clusters that differ in the second input, spread along the first.
    fn clusters() -> Vec<Vec<f64>> {
        (0..120).map(|i| vec![f64::from(i), f64::from(u8::from(i >= 60))]).collect()
    }

    fn map() -> SelfOrganisingMap {
        SelfOrganisingMap::train(&clusters(), [3, 4], &mut Stream::new(1, &["map"]))
    }

    #[test]
    fn every_inner_neuron_has_six_neighbours() {
        let map = SelfOrganisingMap::train(&clusters(), [5, 6], &mut Stream::new(1, &["map"]));
        let neighbours = |neuron: usize| map.u_matrix.iter().filter(|edge| edge.neurons.contains(&neuron)).count();
        for neuron in [7, 10, 14, 21] {
            assert_eq!(neighbours(neuron), 6, "{neuron}");
        }
        assert_eq!((neighbours(0), neighbours(5)), (2, 3));
    }

    #[test]
    fn neurons_cover_the_inputs_and_the_ridge_of_the_u_matrix_parts_the_clusters() {
        let map = map();
        let [angles, clusters] = [&map.component_planes[0], &map.component_planes[1]];
        let (least, most) = angles.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
        assert!(least < 20.0 && most > 100.0, "{least} {most}");
        let across = |edge: &NeighbourDistance| {
            let [a, b] = edge.neurons.map(|neuron| clusters[neuron] > 0.5);
            a != b
        };
        let ridge = map.u_matrix.iter().max_by(|a, b| a.distance.total_cmp(&b.distance)).unwrap();
        assert!(across(ridge), "{ridge:?}");
    }

    #[test]
    fn the_same_stream_gives_the_same_map() {
        assert_eq!(map(), map());
    }
}
