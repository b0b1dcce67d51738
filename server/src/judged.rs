//! How a unit stands against what it has to last for: decided once, for every channel.

use domain::{
    Checks, Day, Flights, Known, Period, PeriodEnd, Plan, RulDistribution, Schedule, Status, Timestamp, Urgency,
    check::WITHIN_FH,
};
use proto::answer::Before;
use store::{Installed, ListedUnit, Outlook, Unit};

use crate::{dates::time_after, present::Present, question::Question};

/// How a unit stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// How its data stand.
    pub status: Status,
    /// What to do about it.
    pub urgency: Urgency,
    /// What it has to last for.
    pub before: Before,
    /// Whether its probability of failure before that is above the risk; `None` where nobody knows.
    pub exceeds_risk: Option<bool>,
    /// Until when that probability stays at most the risk.
    pub safe: Option<Safe>,
    /// The moment at which one in ten has failed.
    pub p10_at: Option<Timestamp>,
    /// By which day it was due by numbers that are not to be relied on any longer.
    pub was_due_by: Option<Day>,
    /// Whole days since data that are old or contradictory.
    pub data_age_days: Option<i64>,
    /// Whether the tail has a check as it was asked about.
    pub has_period: bool,
}

/// The hours within which the probability of failure stays at most a risk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Safe {
    /// Flight hours from the newest data.
    pub remaining_fh: f64,
    /// The day on which they end; `None` where nobody knows.
    pub date: Option<Day>,
}

/// The flights of the tail that a unit is on, and what has to last until then.
#[derive(Clone, Copy)]
pub struct Flown<'a> {
    plan: &'a Plan,
    learned_fh_per_day: Option<f64>,
    checks: &'a Checks,
    /// Other flights than those, if they are assumed.
    assumed: Option<&'a Schedule>,
}

impl<'a> Flown<'a> {
    fn of_listed(listed: &'a ListedUnit) -> Self {
        let ListedUnit { plan, utilisation_fh_per_day, checks, .. } = listed;
        Self { plan, learned_fh_per_day: *utilisation_fh_per_day, checks, assumed: None }
    }

    /// Where a period ends for a unit whose newest data are of `from`.
    fn end(&self, period: &Period, present: &Present, from: Timestamp) -> Option<PeriodEnd> {
        let zone = present.zone();
        let flights = Flights { plan: self.plan, learned_fh_per_day: self.learned_fh_per_day, zone };
        if !self.checks.is_empty() {
            // Checks pass with their days.
            present.today();
        }
        let end = period.end(self.checks, flights, from, present.now())?;
        Some(match (self.assumed, end.date) {
            (Some(assumed), Some(date)) if end.check.is_some() || matches!(period, Period::By(_)) => {
                PeriodEnd { hours: assumed.hours_until(zone.begin_of(date)), ..end }
            }
            _ => end,
        })
    }

    /// Flight hours per day from a time on.
    pub fn schedule(&self, from: Timestamp) -> Schedule {
        self.assumed.cloned().unwrap_or_else(|| self.plan.schedule(from, self.learned_fh_per_day))
    }
}

/// How an installed component stands, by the flights of its tail or by others.
pub fn installed(present: &Present, asked: &Question, one: &Installed, assumed: Option<&Schedule>) -> Judged {
    let Installed { plan, utilisation_fh_per_day, checks, prognosis, .. } = one;
    let flown = Flown { plan, learned_fh_per_day: *utilisation_fh_per_day, checks, assumed };
    let rul = prognosis.as_ref().and_then(|prognosis| Some(&prognosis.forecast.as_ref().ok()?.rul));
    judged(present, asked, &one.in_short(), flown, rul)
}

/// How a listed component stands, as far as it can be told: without its draws, a risk may neither be exceeded nor not.
pub fn listed(present: &Present, asked: &Question, one: &ListedUnit) -> Judged {
    judged(present, asked, &one.unit, Flown::of_listed(one), one.rul.as_ref())
}

fn judged(present: &Present, asked: &Question, unit: &Unit, flown: Flown<'_>, rul: Option<&RulDistribution>) -> Judged {
    let status = present.status_of_unit(unit);
    let as_of = unit.prognosis.as_ref().map(|prognosis| &prognosis.as_of);
    let outlook = unit.prognosis.as_ref().and_then(|prognosis| prognosis.outlook.as_ref().ok());
    let from = as_of.map_or(present.now(), |as_of| as_of.recorded_at);
    let risk = asked.risk.unwrap_or(present.settings().risk);
    let end = flown.end(&asked.period, present, from);
    let has_period = end.is_some();
    let end = end.unwrap_or(PeriodEnd { check: None, date: None, hours: None });
    let schedule = flown.schedule(from);
    let p10_fh = outlook.and_then(|outlook| outlook.quantile_fh(0.1));
    let p10_at = p10_fh.and_then(|hours| time_after(&schedule, hours));
    let exceeds_risk = exceeds(outlook, rul, end.hours, risk);
    let urgency = present.urgency(&Known { status, p10_fh, p10_at, exceeds_risk });
    let safe = safe(present, outlook, rul, &schedule, (end.hours, exceeds_risk), risk);
    let is_uncertain = matches!(status, Status::Stale | Status::Inconsistent);
    let was_due = is_uncertain && (exceeds_risk == Some(true) || urgency == Urgency::ActNow);
    let told = rul.zip(end.hours).filter(|_| unit.found_failed_fh.is_none());
    let (p, standard_error) = told.and_then(|(rul, hours)| rul.probability_within(hours)).unzip();
    Judged {
        status,
        urgency,
        before: Before {
            check: end.check.map(Into::into),
            date: end.date,
            within_fh: end.hours,
            risk,
            p,
            standard_error,
        },
        exceeds_risk,
        safe,
        p10_at,
        was_due_by: safe.filter(|_| was_due).and_then(|safe| safe.date),
        data_age_days: as_of.filter(|_| is_uncertain).map(|as_of| present.days_since(as_of.recorded_at)),
        has_period,
    }
}

/// Whether the probability of failure within some hours is above a risk. Beyond the horizon it is no less than at it.
fn exceeds(outlook: Option<&Outlook>, rul: Option<&RulDistribution>, hours: Option<f64>, risk: f64) -> Option<bool> {
    let (outlook, hours) = outlook.zip(hours)?;
    let within = hours.min(outlook.horizon_fh);
    let exceeds = match rul {
        Some(rul) => rul.probability_within(within).map(|(p, _)| p > risk),
        None => outlook.exceeds(within, risk),
    };
    exceeds.filter(|exceeds| *exceeds || hours <= outlook.horizon_fh)
}

/// The latest safe hours: a quantile lies between two draws, the latter of which may be beyond the hours that were asked
/// about or the horizon; but within those hours the risk is exceeded.
fn safe(
    present: &Present,
    outlook: Option<&Outlook>,
    rul: Option<&RulDistribution>,
    schedule: &Schedule,
    (hours, exceeds_risk): (Option<f64>, Option<bool>),
    risk: f64,
) -> Option<Safe> {
    let quantile = match rul {
        Some(rul) => rul.quantile_fh(risk),
        None => outlook?.quantile_fh(risk),
    };
    let within = hours.filter(|_| exceeds_risk == Some(true));
    let remaining_fh = [quantile, within].into_iter().flatten().reduce(f64::min)?;
    let date = time_after(schedule, remaining_fh).map(|time| present.zone().day_of(time));
    Some(Safe { remaining_fh, date })
}

/// Why nobody knows whether a unit reaches what was asked about, where its forecast itself is to be relied on.
pub fn why_out_of_reach(asked: &Question, listed: &ListedUnit, judged: &Judged) -> Option<String> {
    let tail = &listed.unit.tail;
    let outlook = listed.unit.prognosis.as_ref()?.outlook.as_ref().ok()?;
    match (&asked.period, judged.before.within_fh) {
        _ if judged.exceeds_risk.is_some() => None,
        (Period::Check(name), None) if !judged.has_period => Some(format!("{tail} has no check {name} to come")),
        (_, None) => Some(format!(
            "how much {tail} flies is not known, so neither is what lies before a date: it takes 14 days of data, or a plan"
        )),
        (_, Some(hours)) if hours > outlook.horizon_fh => {
            Some(format!("its forecast ends at {} fh", outlook.horizon_fh))
        }
        _ => None,
    }
}

/// The flight hours that are told with a question: those that were asked about, or those that count without a check.
pub fn within_fh(asked: &Question) -> Option<f64> {
    match asked.period {
        Period::WithinFh(hours) => Some(hours),
        Period::NextCheck => Some(WITHIN_FH),
        Period::By(_) | Period::Check(_) => None,
    }
}
