//! Whether the figures of a bundle make sense, each by itself.
//!
//! A range is where any actuator's figure lies, with a decade or so to spare: it keeps out signs, units and slips of
//! the decimal point. Whether figures make sense together is for the rehearsal.

use std::ops::RangeInclusive;

use diagnosis::{Diagnoser, ErrorLaw};
use domain::{FaultGroup, FaultMeasure, FaultModel, Invalid};
use prognosis::{
    Clock, Coefficient, Coordinate, GrowthLaw, LifePrior, Missions, PaceLaw,
    prior::{BiasPrior, FleetPrior, GroupPrior},
};
use reduction::PodBasis;

use crate::{Assessment, Bundle, LoadModel, MapChain, Metrics, Validation};

/// How far modes may be from orthonormal, and probabilities from a sum of one.
const ROUNDING: f64 = 1e-6;

/// Names every figure of a bundle that makes no sense.
pub fn check(bundle: &Bundle) -> Result<(), Invalid> {
    let mut checked = Checked(Invalid::default());
    checked.faults(&bundle.faults);
    match &bundle.assessment {
        Assessment::Maps(maps) => checked.maps(&bundle.faults, maps),
        Assessment::Own(measure) => checked.measure(&bundle.faults, measure),
    }
    checked.life_prior(&bundle.prior);
    if let Some(loads) = &bundle.loads {
        checked.loads(loads);
    }
    checked.0.into_result(Some(()))
}

/// Where the figures of a prior lie.
struct PriorRanges {
    rate_per_h: RangeInclusive<f64>,
    bias_per_h: RangeInclusive<f64>,
    bias_sd_per_h: RangeInclusive<f64>,
    /// Of a pair, whose mean is none.
    pair_bias_per_h: RangeInclusive<f64>,
    process_noise: RangeInclusive<f64>,
    start: RangeInclusive<f64>,
    failure_offset_fh: RangeInclusive<f64>,
    failure_sd_fh: RangeInclusive<f64>,
}

/// Actuators: growth that feeds on itself, of faults that begin at nothing.
const OF_ACTUATORS: PriorRanges = PriorRanges {
    rate_per_h: 1e-6..=0.05,
    bias_per_h: 0.0..=1e-3,
    bias_sd_per_h: 1e-7..=1e-3,
    pair_bias_per_h: 0.0..=0.0,
    process_noise: 1e-6..=0.01,
    start: -0.01..=0.01,
    failure_offset_fh: -1000.0..=1000.0,
    failure_sd_fh: 0.1..=2000.0,
};

/// What recorded lives teach in reference hours and deviations: growth that slows down, too, and wear that is there at
/// the start.
const OF_LESSONS: PriorRanges = PriorRanges {
    rate_per_h: -0.05..=0.05,
    bias_per_h: -0.01..=0.01,
    bias_sd_per_h: 1e-12..=0.01,
    pair_bias_per_h: -0.01..=0.01,
    process_noise: 1e-12..=0.1,
    start: -1.0..=1.0,
    failure_offset_fh: -1e5..=1e5,
    failure_sd_fh: 1e-6..=1e5,
};

/// What was found so far.
struct Checked(Invalid);

impl Checked {
    fn range(&mut self, path: impl Into<String>, value: f64, range: RangeInclusive<f64>) {
        if !range.contains(&value) {
            let (least, most) = (range.start(), range.end());
            self.0.push(path, format!("{value} is outside {least} to {most}"));
        }
    }

    fn length(&mut self, path: impl Into<String>, found: usize, expected: usize) {
        if found != expected {
            self.0.push(path, format!("{found} values where {expected} are expected"));
        }
    }

    fn finite(&mut self, path: &str, values: &[f64]) {
        for (i, value) in values.iter().enumerate().filter(|(_, value)| !value.is_finite()) {
            self.0.push(format!("{path}/{i}"), format!("{value} is not finite"));
        }
    }

    /// What a part finds wrong with itself, at its place in the bundle.
    fn within(&mut self, path: &str, part: Result<(), Invalid>) {
        for violation in part.err().into_iter().flat_map(|invalid| invalid.violations) {
            self.0.push(format!("{path}{}", violation.pointer.trim_start_matches('#')), violation.detail);
        }
    }

    /// Exponents of any wear that is known, spreads and times of any fleet.
    fn pace(&mut self, law: &PaceLaw) {
        let PaceLaw { exponent, temperature, missions, seen_loads, .. } = law;
        for (name, Coefficient { mean, sd }) in [("exponent", exponent), ("temperature", temperature)] {
            self.range(format!("#/prior/pace/{name}/mean"), *mean, -20.0..=20.0);
            self.range(format!("#/prior/pace/{name}/sd"), *sd, 0.0..=10.0);
        }
        let Missions { mean, life_sd, change_sd, changes_fh, passing_sd, passing_fh, window_sd } = *missions;
        self.range("#/prior/pace/missions/mean", mean, -5.0..=5.0);
        let spreads = [("life", life_sd), ("change", change_sd), ("passing", passing_sd), ("window", window_sd)];
        for (name, sd) in spreads {
            self.range(format!("#/prior/pace/missions/{name}_sd"), sd, 1e-6..=10.0);
        }
        self.range("#/prior/pace/missions/changes_fh", changes_fh, 1.0..=1e7);
        self.range("#/prior/pace/missions/passing_fh", passing_fh, 1.0..=1e7);
        for (i, load) in seen_loads.iter().flatten().enumerate() {
            self.range(format!("#/prior/pace/seen_loads/{i}"), *load, 0.0..=1000.0);
        }
    }

    fn faults(&mut self, faults: &FaultModel) {
        for (i, name) in faults.names.iter().enumerate() {
            if name.is_empty() || faults.names[..i].contains(name) {
                self.0.push(format!("#/faults/names/{i}"), format!("{name:?} is empty or there twice"));
            }
        }
        if faults.is_empty() {
            self.0.push("#/faults/names", "no fault is named");
        }
        self.length("#/faults/nominal", faults.nominal.len(), faults.len());
        self.finite("#/faults/nominal", &faults.nominal);
        let mut times = vec![0; faults.len()];
        for (i, group) in faults.groups.iter().enumerate() {
            let indices = match group {
                FaultGroup::OneSided { index } | FaultGroup::Free { index } => vec![*index],
                FaultGroup::Pair { indices } => indices.to_vec(),
            };
            for index in indices {
                match times.get_mut(index) {
                    Some(times) => *times += 1,
                    None => self.0.push(format!("#/faults/groups/{i}"), format!("there is no fault {index}")),
                }
            }
        }
        for (fault, times) in times.iter().enumerate().filter(|(_, times)| **times != 1) {
            self.0.push("#/faults/groups", format!("fault {fault} is in {times} groups, and must be in one"));
        }
    }

    fn maps(&mut self, faults: &FaultModel, maps: &MapChain) {
        for (i, nominal) in faults.nominal.iter().enumerate() {
            self.range(format!("#/faults/nominal/{i}"), *nominal, 0.0..=1.0);
        }
        self.within("#/motor", maps.motor.check());
        self.diagnoser("#/with_load_ratio", &maps.with_load_ratio);
        self.diagnoser("#/without_load_ratio", &maps.without_load_ratio);
        self.metrics(&maps.metrics);
    }

    fn measure(&mut self, faults: &FaultModel, measure: &FaultMeasure) {
        let FaultMeasure { limits, sigma, characteristic_life_fh } = measure;
        for (name, values) in [("limits", limits), ("sigma", sigma)] {
            self.length(format!("#/measure/{name}"), values.len(), faults.len());
            self.finite(&format!("#/measure/{name}"), values);
        }
        for (i, (limit, nominal)) in limits.iter().zip(&faults.nominal).enumerate() {
            if limit == nominal {
                self.0.push(format!("#/measure/limits/{i}"), format!("{limit} is the nominal value, too"));
            }
        }
        for (i, sigma) in sigma.iter().enumerate().filter(|(_, sigma)| **sigma <= 0.0) {
            self.0.push(format!("#/measure/sigma/{i}"), format!("{sigma} is not above zero"));
        }
        self.range("#/measure/characteristic_life_fh", *characteristic_life_fh, 0.1..=1e6);
        for (i, group) in faults.groups.iter().enumerate() {
            if !matches!(group, FaultGroup::Free { .. }) {
                self.0.push(
                    format!("#/faults/groups/{i}"),
                    "a fault of an own diagnosis is `free`: it has a limit of its own",
                );
            }
        }
    }

    fn diagnoser(&mut self, path: &str, diagnoser: &Diagnoser) {
        let reader = &diagnoser.reader;
        self.range(format!("{path}/reader/noise"), reader.noise, 1e-5..=0.2);
        self.range(format!("{path}/reader/floor"), reader.floor, 0.0..=0.2);
        self.range(format!("{path}/reader/mean_load_offset"), reader.mean_load_offset, -0.3..=0.3);
        self.basis(&format!("{path}/basis"), &diagnoser.basis);
        let (modes, hidden) = (diagnoser.basis.len(), diagnoser.mlp.hidden.len());
        self.range(format!("{path}/mlp/input_scale"), diagnoser.mlp.input_scale, 1e-6..=1e6);
        for (layer, rows, columns) in
            [("hidden", &diagnoser.mlp.hidden, modes + 1), ("output", &diagnoser.mlp.output, hidden + 1)]
        {
            for (i, row) in rows.iter().enumerate() {
                self.length(format!("{path}/mlp/{layer}/{i}"), row.len(), columns);
                self.finite(&format!("{path}/mlp/{layer}/{i}"), row);
            }
        }
        let faults = diagnoser.fault_model.len();
        self.length(format!("{path}/mlp/output"), diagnoser.mlp.output.len(), faults);
        self.error_law(&format!("{path}/error_law"), &diagnoser.error_law, faults);
        if let Some(law) = &diagnoser.mean_load_error_law {
            self.error_law(&format!("{path}/mean_load_error_law"), law, faults);
        }
    }

    fn basis(&mut self, path: &str, basis: &PodBasis) {
        let bins = basis.map_length();
        self.finite(&format!("{path}/mean"), basis.mean());
        for (i, mode) in basis.modes().iter().enumerate() {
            self.length(format!("{path}/modes/{i}"), mode.len(), bins);
            for (j, other) in basis.modes()[..=i].iter().enumerate() {
                let product: f64 = mode.iter().zip(other).map(|(a, b)| a * b).sum();
                let expected = if i == j { 1.0 } else { 0.0 };
                if product.is_nan() || (product - expected).abs() > ROUNDING {
                    let detail = format!("its product with mode {j} is {product}, and must be {expected}");
                    self.0.push(format!("{path}/modes/{i}"), detail);
                }
            }
        }
        let variances = basis.prior_variance();
        self.length(format!("{path}/prior_variance"), variances.len(), basis.len());
        for (i, variance) in variances.iter().enumerate() {
            self.range(format!("{path}/prior_variance/{i}"), *variance, f64::MIN_POSITIVE..=1e4);
            if i > 0 && *variance > variances[i - 1] * (1.0 + ROUNDING) {
                let detail = format!("{variance} is more than the {} of the mode before", variances[i - 1]);
                self.0.push(format!("{path}/prior_variance/{i}"), detail);
            }
        }
    }

    fn error_law(&mut self, path: &str, law: &ErrorLaw, faults: usize) {
        self.length(format!("{path}/weights"), law.weights.len(), faults);
        for (i, weights) in law.weights.iter().enumerate() {
            for (j, (weight, most)) in weights.iter().zip([0.01, 100.0, 1.0]).enumerate() {
                self.range(format!("{path}/weights/{i}/{j}"), *weight, 0.0..=most);
            }
        }
    }

    fn life_prior(&mut self, prior: &LifePrior) {
        match (&prior.growth.laws[..], &prior.companions) {
            ([GrowthLaw { coordinate, prior, .. }], None) if *coordinate == Coordinate::IDENTITY => {
                self.prior("#/prior", prior, &OF_ACTUATORS);
            }
            (laws, _) => self.laws(laws),
        }
        if let Some(law) = &prior.pace {
            self.pace(law);
        }
        if let Some(companions) = &prior.companions {
            self.within("#/prior/companions", companions.check());
        }
    }

    fn laws(&mut self, laws: &[GrowthLaw]) {
        self.range("#/prior/growth/laws", laws.len() as f64, 1.0..=10.0);
        let shares: f64 = laws.iter().map(|law| law.share).sum();
        self.range("#/prior/growth/laws", shares, 1.0 - ROUNDING..=1.0 + ROUNDING);
        for (i, GrowthLaw { coordinate, prior, share }) in laws.iter().enumerate() {
            let path = format!("#/prior/growth/laws/{i}");
            self.range(format!("{path}/share"), *share, 0.0..=1.0);
            self.range(format!("{path}/coordinate/exponent"), coordinate.exponent, -10.0..=10.0);
            self.range(format!("{path}/coordinate/offset"), coordinate.offset, 1e-3..=1e3);
            self.prior(&format!("{path}/prior"), prior, &OF_LESSONS);
            if prior.clock != laws[0].prior.clock {
                self.0.push(format!("{path}/prior/clock"), "it differs from that of the first law");
            }
        }
    }

    fn prior(&mut self, root: &str, prior: &FleetPrior, ranges: &PriorRanges) {
        for (i, rate) in prior.rates_per_h.iter().enumerate() {
            self.range(format!("{root}/rates_per_h/{i}"), *rate, ranges.rate_per_h.clone());
            if i > 0 && *rate <= prior.rates_per_h[i - 1] {
                self.0.push(format!("{root}/rates_per_h/{i}"), format!("{rate} is not more than the rate before"));
            }
        }
        let rates = prior.rates_per_h.len();
        self.group(&format!("{root}/one_sided"), &prior.one_sided, rates, &ranges.bias_per_h, &ranges.bias_sd_per_h);
        self.group(&format!("{root}/pair"), &prior.pair, rates, &ranges.pair_bias_per_h, &ranges.bias_sd_per_h);
        self.range(format!("{root}/process_noise"), prior.process_noise, ranges.process_noise.clone());
        self.range(format!("{root}/start/mean"), prior.start.mean, ranges.start.clone());
        self.range(format!("{root}/start/sd"), prior.start.sd, 1e-6..=1.0);
        self.clock(&format!("{root}/clock"), &prior.clock);
        if let Some(error) = prior.failure_time_error {
            self.range(
                format!("{root}/failure_time_error/offset_fh"),
                error.offset_fh,
                ranges.failure_offset_fh.clone(),
            );
            self.range(format!("{root}/failure_time_error/sd_fh"), error.sd_fh, ranges.failure_sd_fh.clone());
        }
        if let Some(changes) = &prior.growth_changes {
            let path = |field: &str| format!("{root}/growth_changes/{field}");
            self.range(path("probability"), changes.probability, 0.0..=1.0);
            self.range(path("start"), changes.start, 0.05..=20.0);
            self.range(path("interval_fh"), changes.interval_fh, 20.0..=1e5);
            self.range(path("mean_increase"), changes.mean_increase, 0.01..=50.0);
            self.range(path("largest_factor"), changes.largest_factor, 1.0..=100.0);
            self.range(path("particles"), changes.particles as f64, 1.0..=1000.0);
        }
        if let Some(limits) = &prior.consistency {
            let path = |field: &str| format!("{root}/consistency/{field}");
            self.range(path("usual_scatter"), limits.usual_scatter, 0.05..=20.0);
            self.range(path("scatter"), limits.scatter, limits.usual_scatter.max(0.05)..=50.0);
            self.range(path("surprise"), limits.surprise, 0.5..=200.0);
            self.range(path("log_drift"), limits.log_drift, 0.05..=200.0);
        }
    }

    fn clock(&mut self, path: &str, clock: &Clock) {
        let Clock { block_fh, observations, gap_fh, horizon_fh } = *clock;
        self.range(format!("{path}/block_fh"), block_fh, 0.1..=1e4);
        self.range(format!("{path}/observations"), observations as f64, 1.0..=1000.0);
        self.range(format!("{path}/gap_fh"), gap_fh, block_fh.clamp(0.1, 1e5)..=1e5);
        self.range(format!("{path}/horizon_fh"), horizon_fh, block_fh.clamp(0.1, 1e6)..=1e6);
    }

    fn group(
        &mut self,
        path: &str,
        group: &GroupPrior,
        rates: usize,
        mean_per_h: &RangeInclusive<f64>,
        sd_per_h: &RangeInclusive<f64>,
    ) {
        self.length(format!("{path}/rate_weights"), group.rate_weights.len(), rates);
        for (i, weight) in group.rate_weights.iter().enumerate() {
            self.range(format!("{path}/rate_weights/{i}"), *weight, 0.0..=1.0);
        }
        let sum: f64 = group.rate_weights.iter().sum();
        self.range(format!("{path}/rate_weights"), sum, 1.0 - ROUNDING..=1.0 + ROUNDING);
        for (name, bias) in [("minor", group.minor), ("dominant", group.dominant)] {
            let BiasPrior { mean_per_h: mean, sd_per_h: sd } = bias;
            self.range(format!("{path}/{name}/mean_per_h"), mean, mean_per_h.clone());
            self.range(format!("{path}/{name}/sd_per_h"), sd, sd_per_h.clone());
        }
        self.range(format!("{path}/dominance"), group.dominance, 1e-3..=10.0);
    }

    fn loads(&mut self, loads: &LoadModel) {
        self.within("#/loads/sensor_configuration", loads.sensor_configuration.check());
        self.within("#/loads/envelope", loads.envelope.check());
        let references = &loads.references;
        self.range("#/loads/references/flap_nm", references.flap_nm, 1.0..=5e4);
        self.range("#/loads/references/aileron_nm", references.aileron_nm, 1.0..=5e4);
        self.range("#/loads/references/temperature_c", references.temperature_c, -60.0..=100.0);
        self.range("#/loads/references/temperature_scale_k", references.temperature_scale_k, 1.0..=200.0);
    }

    fn metrics(&mut self, metrics: &Metrics) {
        let diagnosis = &metrics.diagnosis;
        let named: [(&str, &Validation); 3] = [
            ("load_ratio_per_sample", &diagnosis.load_ratio_per_sample),
            ("mean_load_ratio", &diagnosis.mean_load_ratio),
            ("no_load_ratio", &diagnosis.no_load_ratio),
        ];
        for (name, validation) in named {
            let path = |field: &str| format!("#/metrics/diagnosis/{name}/{field}");
            for (field, value) in [
                ("median", validation.median),
                ("mean", validation.mean),
                ("p95", validation.p95),
                ("implausible", validation.implausible),
            ] {
                self.range(path(field), value, 0.0..=1.0);
            }
            for (i, share) in validation.coverage_90.iter().enumerate() {
                self.range(format!("{}/{i}", path("coverage_90")), *share, 0.0..=1.0);
            }
        }
    }
}
