//! Answers in protobuf's words.

use domain::{AsOf, HingeLoad, LoadSource, Pace, Propagation, Status, Urgency, UtilisationSource};

use super::upload::timestamp;
use crate::{answer, v1};

impl From<Status> for v1::Status {
    fn from(status: Status) -> Self {
        match status {
            Status::Failed => Self::Failed,
            Status::InsufficientHistory => Self::InsufficientHistory,
            Status::Stale => Self::Stale,
            Status::Inconsistent => Self::Inconsistent,
            Status::BeyondHorizon => Self::BeyondHorizon,
            Status::Current => Self::Current,
        }
    }
}

impl From<Urgency> for v1::Urgency {
    fn from(urgency: Urgency) -> Self {
        match urgency {
            Urgency::Failed => Self::Failed,
            Urgency::ActNow => Self::ActNow,
            Urgency::BeforeCheck => Self::BeforeCheck,
            Urgency::Unknown => Self::Unknown,
            Urgency::MayWait => Self::MayWait,
        }
    }
}

impl From<answer::Before> for v1::Before {
    fn from(before: answer::Before) -> Self {
        let answer::Before { check, date, within_fh, risk, p, standard_error } = before;
        Self { check, date: date.map(Into::into), within_fh, risk, p, standard_error }
    }
}

impl From<answer::RulAnswer> for v1::Rul {
    fn from(body: answer::RulAnswer) -> Self {
        Self {
            tail: body.tail,
            position: body.position,
            displaced: body.displaced,
            part_number: body.part_number,
            serial_number: body.serial_number,
            life: body.life,
            as_of: body.as_of.map(Into::into),
            status: v1::Status::from(body.status).into(),
            missing: body.missing,
            rul_fh: body.rul_fh.map(Into::into),
            censored_fraction: body.censored_fraction,
            horizon_fh: body.horizon_fh,
            probability_of_failure: each(body.probability_of_failure.unwrap_or_default()),
            end_of_life: body.end_of_life.map(Into::into),
            fault_vector: body.fault_vector.into_iter().flatten().map(|(name, fault)| (name, fault.into())).collect(),
            dominant_fault: body.dominant_fault,
            propagation: body.propagation.map(Into::into),
            monte_carlo: body.monte_carlo.map(Into::into),
            model: body.model,
            prior: body.prior,
            mask_id: body.mask_id,
            generation: body.generation,
            numerics_version: body.numerics_version,
            code_version: body.code_version,
            pending_uploads: body.pending_uploads,
            advisory: body.advisory,
            load: body.load.map(Into::into),
            load_agreement: body.load_agreement.map(Into::into),
            explanation: body.explanation.map(Into::into),
            doubts: each(body.doubts.unwrap_or_default()),
            found_failed_fh: body.found_failed_fh,
            set_aside_uploads: body.set_aside_uploads,
            estimator: body.estimator.map(Into::into),
            pace: body.pace.map(Into::into),
            urgency: v1::Urgency::from(body.urgency).into(),
            before: Some(body.before.into()),
            was_due_by: body.was_due_by.map(Into::into),
            data_age_days: body.data_age_days,
        }
    }
}

pub(super) fn each<T: Into<U>, U>(items: Vec<T>) -> Vec<U> {
    items.into_iter().map(Into::into).collect()
}

impl From<AsOf> for v1::AsOf {
    fn from(as_of: AsOf) -> Self {
        Self {
            flight_hours: as_of.flight_hours,
            recorded_at: Some(timestamp(as_of.recorded_at)),
            upload_id: as_of.upload_id.into(),
        }
    }
}

impl From<answer::RulQuantiles> for v1::RulQuantiles {
    fn from(rul: answer::RulQuantiles) -> Self {
        let answer::RulQuantiles { mean, p05, p10, p25, p50, p75, p90, p95 } = rul;
        Self { mean, p05, p10, p25, p50, p75, p90, p95 }
    }
}

impl From<answer::FailureProbability> for v1::FailureProbability {
    fn from(failure: answer::FailureProbability) -> Self {
        let answer::FailureProbability { within_fh, p, standard_error } = failure;
        Self { within_fh, p, standard_error }
    }
}

impl From<answer::EndOfLife> for v1::EndOfLife {
    fn from(end: answer::EndOfLife) -> Self {
        let answer::EndOfLife { date_p10, date_p50, date_p90, utilisation_fh_per_day, utilisation_source } = end;
        let utilisation_source = v1::UtilisationSource::told(Some(utilisation_source));
        Self { date_p10, date_p50, date_p90, utilisation_fh_per_day, utilisation_source }
    }
}

impl v1::UtilisationSource {
    /// The number of a source, or of none.
    pub(super) fn told(source: Option<UtilisationSource>) -> i32 {
        let source = match source {
            None => Self::Unspecified,
            Some(UtilisationSource::Learned) => Self::Learned,
            Some(UtilisationSource::Plan) => Self::Plan,
            Some(UtilisationSource::Assumed) => Self::Assumed,
        };
        source.into()
    }
}

impl From<Pace> for v1::Pace {
    fn from(pace: Pace) -> Self {
        Self {
            now: pace.now,
            last_200_fh: pace.last_200_fh,
            exponent: pace.exponent,
            exponent_sigma: pace.exponent_sigma,
            temperature_coefficient: pace.temperature_coefficient,
            temperature_coefficient_sigma: pace.temperature_coefficient_sigma,
            known_share: pace.known_share,
            motor_share: pace.motor_share,
            clamped_share: pace.clamped_share,
            load: pace.load,
            temperature: pace.temperature,
            seen_loads: pace.seen_loads.map(|[least, greatest]| v1::SeenLoads { least, greatest }),
        }
    }
}

impl From<answer::Fault> for v1::Fault {
    fn from(fault: answer::Fault) -> Self {
        let answer::Fault { value, sigma, trend_per_1000_fh } = fault;
        Self { value, sigma, trend_per_1000_fh }
    }
}

impl From<Propagation> for v1::Propagation {
    fn from(propagation: Propagation) -> Self {
        Self {
            state_matrix: Some(matrix(propagation.state_matrix)),
            state_matrix_sigma: Some(matrix(propagation.state_matrix_sigma)),
            control_matrix: Some(matrix(propagation.control_matrix)),
            control_matrix_sigma: Some(matrix(propagation.control_matrix_sigma)),
            estimator: propagation.estimator,
            observations: propagation.observations as u64,
        }
    }
}

fn matrix(rows: Vec<Vec<f64>>) -> v1::Matrix {
    v1::Matrix { rows: rows.into_iter().map(|values| v1::Row { values }).collect() }
}

impl From<answer::MonteCarlo> for v1::MonteCarlo {
    fn from(monte_carlo: answer::MonteCarlo) -> Self {
        let answer::MonteCarlo { draws, seed, p10_error_fh, median_error_fh } = monte_carlo;
        Self { draws: draws as u64, seed, p10_error_fh, median_error_fh }
    }
}

impl From<LoadSource> for v1::LoadSource {
    fn from(source: LoadSource) -> Self {
        match source {
            LoadSource::StrainAndAirData => Self::StrainAndAirData,
            LoadSource::Strain => Self::Strain,
            LoadSource::AirData => Self::AirData,
        }
    }
}

impl From<HingeLoad> for v1::HingeLoad {
    fn from(load: HingeLoad) -> Self {
        Self {
            hinge_moment_nm: load.hinge_moment_nm,
            sigma_nm: load.sigma_nm,
            ratio: load.ratio,
            source: v1::LoadSource::from(load.source).into(),
            excluded_sensors: load.excluded_sensors.into_iter().map(u32::from).collect(),
            sensor_configuration: load.sensor_configuration.into(),
        }
    }
}

impl From<answer::TailAnswer> for v1::TailDetail {
    fn from(tail: answer::TailAnswer) -> Self {
        Self {
            tail: tail.tail,
            status: v1::Status::from(tail.status).into(),
            rul_p10_fh: tail.rul_p10_fh,
            positions: each(tail.positions),
            displaced: each(tail.displaced),
            load_disagreements: each(tail.load_disagreements),
        }
    }
}

impl From<answer::DisplacedItem> for v1::Displaced {
    fn from(item: answer::DisplacedItem) -> Self {
        Self {
            tail: item.tail,
            position: item.position,
            last_position: item.last_position,
            part_number: item.part_number,
            serial_number: item.serial_number,
            status: v1::Status::from(item.status).into(),
            urgency: v1::Urgency::from(item.urgency).into(),
        }
    }
}

impl From<answer::PositionItem> for v1::PositionDetail {
    fn from(item: answer::PositionItem) -> Self {
        let answer::PositionItem { position, part_number, serial_number, life, prognosis } = item;
        Self { position, part_number, serial_number, life, prognosis: Some(prognosis.into()) }
    }
}

impl From<answer::TailItem> for v1::Tail {
    fn from(item: answer::TailItem) -> Self {
        Self {
            tail: item.tail,
            status: v1::Status::from(item.status).into(),
            rul_p10_fh: item.rul_p10_fh,
            positions: item.positions as u32,
        }
    }
}

impl From<answer::Page<answer::RulAnswer>> for v1::ListRulResponse {
    fn from(page: answer::Page<answer::RulAnswer>) -> Self {
        Self { items: each(page.items), next_cursor: page.next_cursor }
    }
}

impl From<answer::Page<answer::TailItem>> for v1::ListTailsResponse {
    fn from(page: answer::Page<answer::TailItem>) -> Self {
        Self { items: each(page.items), next_cursor: page.next_cursor }
    }
}

impl From<answer::MaskAnswer> for v1::Mask {
    fn from(mask: answer::MaskAnswer) -> Self {
        let answer::MaskAnswer { mask_id, model, coordinate, points, unit } = mask;
        Self { mask_id, model, coordinate, points, unit }
    }
}

impl From<answer::ModelItem> for v1::Model {
    fn from(item: answer::ModelItem) -> Self {
        let answer::ModelItem { hash, active, mask_ids, fault_names, nominal, min_samples, prior } = item;
        Self { hash, active, mask_ids, fault_names, nominal, min_samples: min_samples as u64, prior }
    }
}

impl From<answer::Page<answer::ModelItem>> for v1::ListModelsResponse {
    fn from(page: answer::Page<answer::ModelItem>) -> Self {
        Self { items: each(page.items) }
    }
}
