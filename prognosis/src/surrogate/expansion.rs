//! Radial basis functions over shared centres: what every surrogate evaluates online.

use domain::FaultModel;
use serde::{Deserialize, Serialize};

/// Centres that are evaluated side by side; one block of them holds this many.
const LANES: usize = 8;
/// Most outputs of one expansion, so that its evaluation needs no heap.
pub(super) const MAX_OUTPUTS: usize = 8;
/// Most faults, likewise.
const MAX_FAULTS: usize = 8;
/// Faults and outputs of an actuator's surrogate.
const USUAL_SIZES: (usize, usize) = (5, 3);
/// Blocks whose basis functions a look remembers between its two passes; those beyond are computed twice.
const KEPT: usize = 48;

/// Maps a fault vector to deviations from nominal in units of the largest possible one, so that
/// severities stay k and eccentricities become 2 k - 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scaling {
    nominal: Vec<f64>,
    factor: Vec<f64>,
}

impl Scaling {
    /// The scaling of a fault model whose entries lie in [0, 1].
    pub fn new(faults: &FaultModel) -> Self {
        let factor = faults.nominal.iter().map(|&nominal| 1.0 / nominal.max(1.0 - nominal)).collect();
        Self { nominal: faults.nominal.clone(), factor }
    }

    /// Number of entries of a fault vector.
    pub fn len(&self) -> usize {
        self.nominal.len()
    }

    /// Whether fault vectors are empty.
    pub fn is_empty(&self) -> bool {
        self.nominal.is_empty()
    }

    /// The scaled fault vector.
    pub fn apply(&self, k: &[f64]) -> Vec<f64> {
        k.iter().enumerate().map(|(entry, &k)| self.entry(entry, k)).collect()
    }

    fn entry(&self, entry: usize, k: f64) -> f64 {
        (k - self.nominal[entry]) * self.factor[entry]
    }
}

/// One output of an expansion, in scaled coordinates x.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Output {
    /// Value where every basis function vanishes and x = 0.
    pub constant: f64,
    /// Slope along each scaled fault.
    pub slope: Vec<f64>,
    /// Weight of each centre.
    pub weights: Vec<f64>,
}

/// The least output of an expansion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Least {
    /// Its value.
    pub value: f64,
    /// Its index.
    pub output: usize,
    /// Squared distance of the nearest centre, in scaled coordinates.
    pub squared_distance: f64,
}

/// What one pass over the centres gathers, lane by lane.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sweep {
    /// Kernel part of each output.
    sums: [[f64; LANES]; MAX_OUTPUTS],
    /// Least squared distances.
    nearest: [f64; LANES],
}

/// What a second pass over the centres gathers of one output, lane by lane.
struct Moments {
    /// Sum of w_c K_c.
    total: [f64; LANES],
    /// Sum of w_c K_c c.
    first: [[f64; LANES]; MAX_FAULTS],
}

/// f_o(x) = constant_o + slope_o . x + sum_c w_oc exp(-gamma |x - c|^2), x = scaled fault vector.
///
/// Centres are stored in blocks of [`LANES`]: for each fault the coordinates of the block's centres,
/// then for each output their weights. Every sum runs in a fixed order over IEEE operations only, so
/// that results are the same bits wherever vector registers of any width are used. The last block is
/// filled up with copies of the last centre at weight zero.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Parts")]
pub(super) struct RbfExpansion {
    scaling: Scaling,
    gamma: f64,
    affine: Vec<f64>,
    blocks: Vec<f64>,
}

/// An expansion as read, before its sizes are checked.
#[derive(Deserialize)]
struct Parts {
    scaling: Scaling,
    gamma: f64,
    affine: Vec<f64>,
    blocks: Vec<f64>,
}

impl TryFrom<Parts> for RbfExpansion {
    type Error = String;
    fn try_from(parts: Parts) -> Result<Self, String> {
        let Parts { scaling, gamma, affine, blocks } = parts;
        let faults = scaling.len();
        let outputs = affine.len() / (faults + 1);
        let sizes_agree = scaling.factor.len() == faults
            && affine.len() == outputs * (faults + 1)
            && (1..=MAX_OUTPUTS).contains(&outputs)
            && faults <= MAX_FAULTS
            && blocks.len().is_multiple_of((faults + outputs) * LANES);
        if !sizes_agree {
            return Err(format!("surrogate of {faults} faults with {} affine terms", affine.len()));
        }
        Ok(Self { scaling, gamma, affine, blocks })
    }
}

impl RbfExpansion {
    /// The expansion with these scaled centres; every output has one weight per centre.
    pub fn new(scaling: Scaling, gamma: f64, centres: &[&[f64]], outputs: &[Output]) -> Self {
        assert!((1..=MAX_OUTPUTS).contains(&outputs.len()), "{} outputs", outputs.len());
        assert!(scaling.len() <= MAX_FAULTS, "{} faults", scaling.len());
        assert!(outputs.iter().all(|o| o.weights.len() == centres.len() && o.slope.len() == scaling.len()));
        let affine = outputs.iter().flat_map(|o| std::iter::once(o.constant).chain(o.slope.iter().copied())).collect();
        let mut blocks = Vec::new();
        for first in (0..centres.len()).step_by(LANES) {
            let centre_of_lane = |lane: usize| centres[(first + lane).min(centres.len() - 1)];
            for entry in 0..scaling.len() {
                blocks.extend((0..LANES).map(|lane| centre_of_lane(lane)[entry]));
            }
            for output in outputs {
                blocks.extend((0..LANES).map(|lane| output.weights.get(first + lane).copied().unwrap_or(0.0)));
            }
        }
        Self { scaling, gamma, affine, blocks }
    }

    /// The least output at the fault vector `k` (nominal values included).
    pub fn minimum(&self, k: &[f64]) -> f64 {
        let x = self.scaled(k);
        self.least(&self.sweep(&x, &mut []), &x).value
    }

    /// The least output at the fault vector `k` with its derivatives, which are written to `gradient`.
    pub fn look(&self, k: &[f64], gradient: &mut [f64]) -> Least {
        let x = self.scaled(k);
        let mut kept = [[0.0; LANES]; KEPT];
        let least = self.least(&self.sweep(&x, &mut kept), &x);
        let slopes = self.slopes(&x, &kept, least.output);
        for (entry, slope) in gradient.iter_mut().enumerate() {
            *slope = slopes[entry] * self.scaling.factor[entry];
        }
        least
    }

    /// Distance of the fault vector `k` from the nearest centre, in scaled coordinates.
    pub fn distance_to_nearest_centre(&self, k: &[f64]) -> f64 {
        let x = self.scaled(k);
        self.sweep(&x, &mut []).nearest.iter().copied().fold(f64::INFINITY, f64::min).sqrt()
    }

    /// Number of faults and of outputs.
    fn sizes(&self) -> (usize, usize) {
        let faults = self.scaling.len();
        (faults, self.affine.len() / (faults + 1))
    }

    fn scaled(&self, k: &[f64]) -> [f64; MAX_FAULTS] {
        assert_eq!(k.len(), self.scaling.len(), "a fault vector of another model");
        let mut x = [0.0; MAX_FAULTS];
        k.iter().enumerate().for_each(|(entry, &k)| x[entry] = self.scaling.entry(entry, k));
        x
    }

    /// Passes all centres once, as wide as the processor's registers are; `kept` gets the basis functions
    /// of as many blocks as it has room for.
    fn sweep(&self, x: &[f64; MAX_FAULTS], kept: &mut [[f64; LANES]]) -> Sweep {
        pulp::Arch::new().dispatch(SweepPass { expansion: self, x, kept })
    }

    #[inline(always)]
    fn pass(&self, (faults, outputs): (usize, usize), x: &[f64; MAX_FAULTS], kept: &mut [[f64; LANES]]) -> Sweep {
        let mut kept = kept.iter_mut();
        let mut sums = [[0.0; LANES]; MAX_OUTPUTS];
        let mut nearest = [f64::INFINITY; LANES];
        for block in self.blocks.as_chunks::<LANES>().0.chunks_exact(faults + outputs) {
            let (centres, weights) = block.split_at(faults);
            let squared = squared_distances(centres, &x[..faults]);
            let mut basis = [0.0; LANES];
            for lane in 0..LANES {
                nearest[lane] = if squared[lane] < nearest[lane] { squared[lane] } else { nearest[lane] };
                basis[lane] = exp_negative(-self.gamma * squared[lane]);
            }
            for (sum, weights) in sums[..outputs].iter_mut().zip(weights) {
                for lane in 0..LANES {
                    sum[lane] += weights[lane] * basis[lane];
                }
            }
            if let Some(kept) = kept.next() {
                *kept = basis;
            }
        }
        Sweep { sums, nearest }
    }

    fn least(&self, sweep: &Sweep, x: &[f64; MAX_FAULTS]) -> Least {
        let squared_distance = sweep.nearest.iter().copied().fold(f64::INFINITY, f64::min);
        let affine = self.affine.chunks_exact(self.scaling.len() + 1);
        let value = |(affine, sum): (&[f64], &[f64; LANES])| affine_value(affine, x) + sum.iter().sum::<f64>();
        let values = affine.zip(&sweep.sums).map(value).enumerate();
        let least = values.reduce(|least, next| if next.1 < least.1 { next } else { least });
        let (output, value) = least.expect("an expansion has outputs");
        Least { value, output, squared_distance }
    }

    /// Derivatives of an output by the scaled coordinates x, from the values of its basis functions K_c:
    /// slope - 2 gamma (x sum_c w_c K_c - sum_c w_c K_c c).
    fn slopes(&self, x: &[f64; MAX_FAULTS], kept: &[[f64; LANES]], output: usize) -> [f64; MAX_FAULTS] {
        let Moments { total, first } = pulp::Arch::new().dispatch(MomentsPass { expansion: self, x, kept, output });
        let (total, faults) = (total.iter().sum::<f64>(), self.scaling.len());
        let slope = &self.affine[output * (faults + 1) + 1..][..faults];
        let mut slopes = [0.0; MAX_FAULTS];
        for (entry, slope) in slope.iter().enumerate() {
            slopes[entry] = slope - 2.0 * self.gamma * (x[entry] * total - first[entry].iter().sum::<f64>());
        }
        slopes
    }

    #[inline(always)]
    fn moments(
        &self,
        (faults, outputs): (usize, usize),
        x: &[f64; MAX_FAULTS],
        kept: &[[f64; LANES]],
        output: usize,
    ) -> Moments {
        let mut moments = Moments { total: [0.0; LANES], first: [[0.0; LANES]; MAX_FAULTS] };
        let Moments { total, first } = &mut moments;
        let blocks = self.blocks.as_chunks::<LANES>().0.chunks_exact(faults + outputs);
        for (index, block) in blocks.enumerate() {
            let (centres, weights) = block.split_at(faults);
            let mut terms = match kept.get(index) {
                Some(basis) => *basis,
                None => squared_distances(centres, &x[..faults]).map(|squared| exp_negative(-self.gamma * squared)),
            };
            for lane in 0..LANES {
                terms[lane] *= weights[output][lane];
                total[lane] += terms[lane];
            }
            for (first, row) in first.iter_mut().zip(centres) {
                for lane in 0..LANES {
                    first[lane] += terms[lane] * row[lane];
                }
            }
        }
        moments
    }
}

/// A sweep, to be compiled once per width of registers. (A closure would not do: what calls it is compiled without
/// wide registers, and never becomes part of what has them.)
struct SweepPass<'a> {
    expansion: &'a RbfExpansion,
    x: &'a [f64; MAX_FAULTS],
    kept: &'a mut [[f64; LANES]],
}

impl pulp::WithSimd for SweepPass<'_> {
    type Output = Sweep;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Sweep {
        let Self { expansion, x, kept } = self;
        match expansion.sizes() {
            // Sizes that are known when this is compiled keep every sum in a register.
            USUAL_SIZES => expansion.pass(USUAL_SIZES, x, kept),
            sizes => expansion.pass(sizes, x, kept),
        }
    }
}

/// The second pass of a look, likewise.
struct MomentsPass<'a> {
    expansion: &'a RbfExpansion,
    x: &'a [f64; MAX_FAULTS],
    kept: &'a [[f64; LANES]],
    output: usize,
}

impl pulp::WithSimd for MomentsPass<'_> {
    type Output = Moments;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Moments {
        let Self { expansion, x, kept, output } = self;
        match expansion.sizes() {
            USUAL_SIZES => expansion.moments(USUAL_SIZES, x, kept, output),
            sizes => expansion.moments(sizes, x, kept, output),
        }
    }
}

/// Squared distances of the centres of a block from x.
#[inline(always)]
fn squared_distances(centres: &[[f64; LANES]], x: &[f64]) -> [f64; LANES] {
    let mut squared = [0.0; LANES];
    for entry in 0..x.len() {
        for lane in 0..LANES {
            let difference = x[entry] - centres[entry][lane];
            squared[lane] += difference * difference;
        }
    }
    squared
}

/// Constant and slopes of an output at scaled coordinates.
fn affine_value(affine: &[f64], x: &[f64; MAX_FAULTS]) -> f64 {
    affine[1..].iter().zip(x).fold(affine[0], |sum, (slope, x)| sum + slope * x)
}

/// exp(-gamma |a - b|^2), the kernel of training and evaluation alike.
pub(super) fn kernel(gamma: f64, a: &[f64], b: &[f64]) -> f64 {
    let squared: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    exp_negative(-gamma * squared)
}

/// exp(x) for x <= 0 within 2e-15 of its value, about 1e-304 for all x below -700.
///
/// x = n ln 2 + r with |r| <= ln 2 / 2, exp(r) by its Taylor series to the 12th power, 2^n by its bits.
/// Free of branches and tables, so that compilers evaluate several at once, and made of IEEE
/// operations only, so that it is the same bits however they do it. The series is summed in groups
/// (Estrin), because one long chain would leave the processor waiting.
#[inline(always)]
fn exp_negative(x: f64) -> f64 {
    // Adding 1.5 * 2^52 rounds to an integer, which then stands in the low bits of the sum.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    // ln 2 in two parts, the first with trailing zeros so that n * LN_2_HIGH is exact.
    const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    let x = if x < -700.0 { -700.0 } else { x };
    let rounded = x * std::f64::consts::LOG2_E + ROUND;
    let n = rounded - ROUND;
    let r = (x - n * LN_2_HIGH) - n * LN_2_LOW;
    let r2 = r * r;
    let r4 = r2 * r2;
    let low = (1.0 + r) + r2 * (1.0 / 2.0 + r * (1.0 / 6.0));
    let middle = (1.0 / 24.0 + r * (1.0 / 120.0)) + r2 * (1.0 / 720.0 + r * (1.0 / 5_040.0));
    let high = (1.0 / 40_320.0 + r * (1.0 / 362_880.0)) + r2 * (1.0 / 3_628_800.0 + r * (1.0 / 39_916_800.0));
    let series = low + r4 * (middle + r4 * (high + r4 * (1.0 / 479_001_600.0)));
    let power_of_two = f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52);
    series * power_of_two
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_faults() -> Scaling {
        let names = ["a", "b"].map(str::to_owned).into();
        Scaling::new(&FaultModel { names, nominal: vec![0.0, 0.5], groups: vec![] })
    }

    #[test]
    fn exponential_agrees_with_the_library() {
        for i in 0..=70_000 {
            let x = -0.01 * f64::from(i);
            let expected = libm::exp(x);
            assert!((exp_negative(x) - expected).abs() <= 2e-15 * expected, "exp({x})");
        }
        assert_eq!(exp_negative(0.0), 1.0);
        assert!(exp_negative(-1e300) < 1e-300 && exp_negative(f64::NAN).is_nan());
    }

    #[test]
    fn electrical_faults_are_scaled_as_deviations() {
        let scaling = Scaling::new(&FaultModel::electrical());
        assert_eq!(scaling.apply(&[0.0, 0.3, 1.0, 0.75, 0.0]), [0.0, 0.3, 1.0, 0.5, -1.0]);
    }

    /// Eleven centres, so that the last block is not full, evaluated against the bare formula.
    #[test]
    fn expansion_is_its_formula() {
        let centres: Vec<[f64; 2]> =
            (0..11).map(|i| [0.09 * f64::from(i), 0.5 - 0.013 * f64::from(i * i % 7)]).collect();
        let centres: Vec<&[f64]> = centres.iter().map(|c| &c[..]).collect();
        let output = |constant: f64, sign: f64| Output {
            constant,
            slope: vec![0.7, -sign],
            weights: (0..11).map(|i| sign * f64::from(i - 4)).collect(),
        };
        let outputs = [output(3.0, 1.0), output(2.0, -0.5)];
        let expansion = RbfExpansion::new(two_faults(), 2.0, &centres, &outputs);
        let x = [0.31, 0.24];
        let value = |output: &Output| {
            let sum: f64 = (0..11).map(|c| output.weights[c] * kernel(2.0, &x, centres[c])).sum();
            output.constant + output.slope[0] * x[0] + output.slope[1] * x[1] + sum
        };
        let expected = value(&outputs[0]).min(value(&outputs[1]));
        assert!((expansion.minimum(&[0.31, 0.62]) - expected).abs() < 1e-13);
        let nearest = centres.iter().map(|c| (x[0] - c[0]).hypot(x[1] - c[1])).fold(f64::INFINITY, f64::min);
        assert!((expansion.distance_to_nearest_centre(&[0.31, 0.62]) - nearest).abs() < 1e-14);
    }

    /// Any width of vector registers gives the same bits.
    #[test]
    fn wide_and_narrow_sweeps_agree_to_the_bit() {
        let centres: Vec<Vec<f64>> =
            (0..45).map(|i| vec![(0.37 * f64::from(i)).sin(), (0.73 * f64::from(i)).cos()]).collect();
        let centres: Vec<&[f64]> = centres.iter().map(|c| &c[..]).collect();
        let output =
            Output { constant: 0.3, slope: vec![0.1, 0.2], weights: (0..45).map(|i| f64::from(i % 7) - 3.3).collect() };
        let expansion = RbfExpansion::new(two_faults(), 2.0, &centres, &[output]);
        for i in 0..50 {
            let x = expansion.scaled(&[0.01 * f64::from(i), 1.0 - 0.013 * f64::from(i)]);
            assert_eq!(expansion.sweep(&x, &mut []), expansion.pass(expansion.sizes(), &x, &mut []));
        }
    }

    #[test]
    fn gradients_are_those_of_the_least_output() {
        let output = |sign: f64| Output { constant: 0.1, slope: vec![0.4, sign], weights: vec![sign, 0.7, -0.4] };
        let outputs = [output(1.0), output(-1.0)];
        let expansion = RbfExpansion::new(two_faults(), 2.0, &[&[0.1, 0.2], &[0.4, -0.3], &[0.7, 0.1]], &outputs);
        for k in [[0.3, 0.8], [0.5, 0.2], [0.0, 0.5]] {
            let mut gradient = [0.0; 2];
            let least = expansion.look(&k, &mut gradient);
            assert_eq!(least.value, expansion.minimum(&k));
            for entry in 0..2 {
                let moved = |by: f64| {
                    let mut moved = k;
                    moved[entry] += by;
                    expansion.minimum(&moved)
                };
                let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                assert!((gradient[entry] - slope).abs() < 1e-8, "{gradient:?} and {slope} along {entry} at {k:?}");
            }
        }
    }

    #[test]
    fn an_expansion_whose_sizes_disagree_is_refused() {
        let output = Output { constant: 0.0, slope: vec![0.0; 2], weights: vec![1.0] };
        let expansion = RbfExpansion::new(two_faults(), 2.0, &[&[0.1, 0.2]], &[output]);
        let mut json = serde_json::to_value(&expansion).unwrap();
        assert_eq!(serde_json::from_value::<RbfExpansion>(json.clone()).unwrap(), expansion);
        json["blocks"].as_array_mut().unwrap().pop();
        assert!(serde_json::from_value::<RbfExpansion>(json).is_err());
    }
}
