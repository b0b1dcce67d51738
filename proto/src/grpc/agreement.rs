//! Whether motor and wing tell of the same loads.

use domain::{Disagreement, DisagreementKind, LoadAgreement, load_agreement::LoadsTold};

use super::{answer::each, upload::timestamp};
use crate::{answer::TailDisagreement, v1};

impl From<LoadAgreement> for v1::LoadAgreement {
    fn from(agreement: LoadAgreement) -> Self {
        Self {
            flights: agreement.flights as u64,
            efficiency: agreement.efficiency,
            efficiency_sigma: agreement.efficiency_sigma,
            friction: agreement.friction,
            friction_sigma: agreement.friction_sigma,
            disagreements: each(agreement.disagreements),
            course: each(agreement.course),
        }
    }
}

impl From<Disagreement> for v1::Disagreement {
    fn from(Disagreement { kind, since_fh, since, size, sigma, grating, detail }: Disagreement) -> Self {
        Self {
            kind: v1::DisagreementKind::from(kind).into(),
            since_fh,
            since: Some(timestamp(since)),
            size,
            sigma,
            grating: grating.map(u32::from),
            detail,
        }
    }
}

impl From<DisagreementKind> for v1::DisagreementKind {
    fn from(kind: DisagreementKind) -> Self {
        match kind {
            DisagreementKind::Efficiency => Self::Efficiency,
            DisagreementKind::Friction => Self::Friction,
            DisagreementKind::SensorConfiguration => Self::SensorConfiguration,
            DisagreementKind::Grating => Self::Grating,
        }
    }
}

impl From<LoadsTold> for v1::LoadsTold {
    fn from(LoadsTold { flight_hours, wing, motor }: LoadsTold) -> Self {
        Self { flight_hours, wing, motor }
    }
}

impl From<TailDisagreement> for v1::TailDisagreement {
    fn from(TailDisagreement { positions, kind, since, detail }: TailDisagreement) -> Self {
        Self { positions, kind: v1::DisagreementKind::from(kind).into(), since: Some(timestamp(since)), detail }
    }
}
