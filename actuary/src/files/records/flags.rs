//! What a user says of the columns of recorded lives.

use clap::Args;

/// The flags that tell what the columns of a table of recorded lives are.
#[derive(Debug, Clone, Default, Args)]
pub struct Flags {
    /// A column that tells how damaged a unit is, and the value at which it has failed: absolute (crack_mm=49.8), relative to the
    /// nominal value (capacity_ah=-18%), or `learned` from the last values of units that failed. Repeated for several; other
    /// columns are ignored.
    #[arg(long = "limit", value_name = "NAME=VALUE", value_parser = limit)]
    pub limits: Vec<Limit>,
    /// The value of a column where nothing is damaged, or first:N, the median of the first N rows of each unit [default: the
    /// median over units of their first row].
    #[arg(long = "nominal", value_name = "NAME=VALUE", value_parser = nominal)]
    pub nominals: Vec<Nominal>,
    /// The standard deviation of one value of a column [default: learned].
    #[arg(long = "sigma", value_name = "NAME=VALUE", value_parser = sigma)]
    pub sigmas: Vec<Sigma>,
    /// The column of times since the start of a life, and what they are counted in [default: the one among t, time, t_fh, hours,
    /// cycle, cycles and days; its name].
    #[arg(long, value_name = "COLUMN[:UNIT]")]
    pub time: Option<String>,
    /// The column that names the unit [default: the one among unit, specimen, cell, device, run_id, id and serial_number].
    #[arg(long, value_name = "COLUMN")]
    pub unit: Option<String>,
    /// The column that tells whether a unit failed or was removed before it did: `failed` or `removed` in the row of its latest
    /// time. The passage of a limit counts first.
    #[arg(long, value_name = "COLUMN")]
    pub end: Option<String>,
}

/// The limit of a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// The column.
    pub name: String,
    /// Where it lies.
    pub at: LimitAt,
}

/// Where a limit lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LimitAt {
    /// At a value.
    Value(f64),
    /// So far from nominal, as a share of the nominal value.
    Share(f64),
    /// Where units that failed were seen last.
    Learned,
}

/// The nominal value of a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Nominal {
    /// The column.
    pub name: String,
    /// What it is.
    pub is: NominalIs,
}

/// What is nominal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NominalIs {
    /// A value.
    Value(f64),
    /// The median of so many first rows of each unit.
    First(usize),
}

/// The noise of a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Sigma {
    /// The column.
    pub name: String,
    /// Standard deviation of one value.
    pub value: f64,
}

impl Flags {
    /// The first flag that says something about a column without a limit being told.
    pub fn without_limits(&self) -> Option<&'static str> {
        let said = [
            ("--nominal", !self.nominals.is_empty()),
            ("--sigma", !self.sigmas.is_empty()),
            ("--time", self.time.is_some()),
            ("--unit", self.unit.is_some()),
            ("--end", self.end.is_some()),
        ];
        said.into_iter().find_map(|(flag, said)| (said && self.limits.is_empty()).then_some(flag))
    }

    /// The first name that is said twice by one flag, or has no limit, and the flag.
    pub fn contradiction(&self) -> Option<String> {
        let names = |flag, names: Vec<&str>| (flag, names.into_iter().map(str::to_owned).collect::<Vec<_>>());
        let limited: Vec<&str> = self.limits.iter().map(|limit| limit.name.as_str()).collect();
        let all = [
            names("--limit", limited.clone()),
            names("--nominal", self.nominals.iter().map(|nominal| nominal.name.as_str()).collect()),
            names("--sigma", self.sigmas.iter().map(|sigma| sigma.name.as_str()).collect()),
        ];
        all.into_iter().find_map(|(flag, names)| {
            let twice = (1..names.len()).find(|&i| names[..i].contains(&names[i]));
            let unlimited = names.iter().find(|name| !limited.contains(&name.as_str()));
            let twice = twice.map(|i| format!("{flag} tells of {} twice", names[i]));
            twice.or_else(|| unlimited.map(|name| format!("{flag} tells of {name}, which has no --limit")))
        })
    }
}

fn limit(text: &str) -> Result<Limit, String> {
    let (name, value) = pair(text)?;
    let at = match value.strip_suffix('%') {
        Some(share) => LimitAt::Share(number(share)? / 100.0),
        None if value == "learned" => LimitAt::Learned,
        None => LimitAt::Value(number(value)?),
    };
    if at == LimitAt::Share(0.0) { Err("a limit of 0 % is nominal".to_owned()) } else { Ok(Limit { name, at }) }
}

fn nominal(text: &str) -> Result<Nominal, String> {
    let (name, value) = pair(text)?;
    let is = match value.strip_prefix("first:") {
        Some(rows) => match rows.parse() {
            Ok(rows) if rows > 0 => NominalIs::First(rows),
            _ => return Err(format!("\"{rows}\" is not a number of rows")),
        },
        None => NominalIs::Value(number(value)?),
    };
    Ok(Nominal { name, is })
}

fn sigma(text: &str) -> Result<Sigma, String> {
    let (name, value) = pair(text)?;
    match number(value)? {
        value if value > 0.0 => Ok(Sigma { name, value }),
        value => Err(format!("{value} is not above zero")),
    }
}

fn pair(text: &str) -> Result<(String, &str), String> {
    match text.rsplit_once('=') {
        Some((name, value)) if !name.trim().is_empty() => Ok((name.trim().to_owned(), value.trim())),
        _ => Err("not NAME=VALUE".to_owned()),
    }
}

fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!("\"{}\" is not a finite number", text.trim())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_a_value_a_share_of_nominal_or_learned() {
        let at = |text| limit(text).map(|limit| (limit.name, limit.at));
        assert_eq!(at("crack_mm=49.8"), Ok(("crack_mm".to_owned(), LimitAt::Value(49.8))));
        assert_eq!(at("a=b = -18 %"), Ok(("a=b".to_owned(), LimitAt::Share(-0.18))));
        assert_eq!(at("h=learned"), Ok(("h".to_owned(), LimitAt::Learned)));
        for wrong in ["49.8", "=3", "a=", "a=nan", "a=inf", "a=0%", "a=x%", "a=Learned"] {
            assert!(limit(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn nominal_is_a_value_or_the_first_rows_and_noise_is_above_zero() {
        let is = |text| nominal(text).map(|nominal| nominal.is);
        assert_eq!((is("c=9"), is("c=first:5")), (Ok(NominalIs::Value(9.0)), Ok(NominalIs::First(5))));
        assert!(["c=first:0", "c=first:", "c=last:3"].iter().all(|wrong| nominal(wrong).is_err()));
        assert_eq!(sigma("c=.1"), Ok(Sigma { name: "c".to_owned(), value: 0.1 }));
        assert!(["c=0", "c=-1", "c=x"].iter().all(|wrong| sigma(wrong).is_err()));
    }

    #[test]
    fn a_name_that_is_told_twice_or_has_no_limit_is_a_contradiction() {
        let flags = |limits: &[&str], nominals: &[&str]| Flags {
            limits: limits.iter().map(|text| limit(text).unwrap()).collect(),
            nominals: nominals.iter().map(|text| nominal(text).unwrap()).collect(),
            ..Flags::default()
        };
        assert_eq!(flags(&["a=1", "b=1"], &["b=0"]).contradiction(), None);
        assert_eq!(flags(&["a=1", "a=2"], &[]).contradiction().unwrap(), "--limit tells of a twice");
        assert_eq!(flags(&["a=1"], &["b=0"]).contradiction().unwrap(), "--nominal tells of b, which has no --limit");
    }
}
