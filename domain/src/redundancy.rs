//! Functions that several units of a tail serve together: as long as enough of them work, it is there.
//!
//! Card. *What:* n positions, of which k are needed. *Rule:* units fail independently of one another, so the number of
//! failures is a sum of independent yes-or-no draws (Poisson binomial). *Requires:* a position serves at most one function.

use serde::{Deserialize, Serialize};

use crate::{Invalid, Position, text};

/// Most functions of an operator.
pub const MAX_FUNCTIONS: usize = 100;
/// Most positions of a function.
pub const MAX_POSITIONS: usize = 64;
/// Most characters of a function's name.
pub const MAX_NAME: usize = 32;

/// A function that several units serve together.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Function {
    /// Its name.
    pub name: String,
    /// The positions of the units that serve it.
    pub positions: Vec<Position>,
    /// How many of them have to work.
    pub needed: usize,
}

/// Names everything that is wrong with functions.
pub(crate) fn check(functions: &[Function], invalid: &mut Invalid) {
    if functions.len() > MAX_FUNCTIONS {
        invalid.push("#/functions", format!("{} functions, not at most {MAX_FUNCTIONS}", functions.len()));
        return;
    }
    for (i, function) in functions.iter().enumerate() {
        let Function { name, positions, needed } = function;
        let length = name.chars().count();
        let length = (!(1..=MAX_NAME).contains(&length)).then(|| format!("{length} characters, not 1 to {MAX_NAME}"));
        let twice = functions[..i].iter().any(|other| other.name == *name).then(|| format!("{name:?} is there twice"));
        if let Some(refusal) = length.or_else(|| text::not_of_a_name(name)).or(twice) {
            invalid.push(format!("#/functions/{i}/name"), refusal);
        }
        if !(1..=MAX_POSITIONS).contains(&positions.len()) {
            let detail = format!("{} positions, not 1 to {MAX_POSITIONS}", positions.len());
            invalid.push(format!("#/functions/{i}/positions"), detail);
        } else if !(1..=positions.len()).contains(needed) {
            let detail = format!("{needed} is not a number from 1 to {}, as many as it has", positions.len());
            invalid.push(format!("#/functions/{i}/needed"), detail);
        }
        let before = functions[..i].iter().flat_map(|other| &other.positions);
        for (at, position) in positions.iter().enumerate() {
            if before.clone().chain(&positions[..at]).any(|other| other == position) {
                let detail = format!("{position} serves a function already");
                invalid.push(format!("#/functions/{i}/positions/{at}"), detail);
            }
        }
    }
}

/// P(fewer than `needed` of independent units work), each failing with its probability.
pub fn probability_lost(needed: usize, failing: &[f64]) -> f64 {
    // P(so many work), unit by unit.
    let mut working = vec![0.0; failing.len() + 1];
    working[0] = 1.0;
    for (units, &p) in failing.iter().enumerate() {
        for count in (0..=units + 1).rev() {
            let one_more = if count > 0 { working[count - 1] * (1.0 - p) } else { 0.0 };
            working[count] = working[count] * p + one_more;
        }
    }
    let lost: f64 = working.iter().take(needed.min(working.len())).sum();
    lost.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn function(name: &str, positions: &[&str], needed: usize) -> Function {
        let positions = positions.iter().map(|position| position.parse().unwrap()).collect();
        Function { name: name.to_owned(), positions, needed }
    }

    #[test]
    fn a_function_is_lost_when_too_few_work() {
        assert!((probability_lost(2, &[0.1, 0.2]) - (1.0 - 0.9 * 0.8)).abs() < 1e-15, "both are needed");
        assert!((probability_lost(1, &[0.1, 0.2]) - 0.1 * 0.2).abs() < 1e-15, "one is enough");
        let two_of_three = 0.1 * 0.2 + 0.1 * 0.3 + 0.2 * 0.3 - 2.0 * 0.1 * 0.2 * 0.3;
        assert!((probability_lost(2, &[0.1, 0.2, 0.3]) - two_of_three).abs() < 1e-15);
        assert_eq!(probability_lost(1, &[0.0; 8]), 0.0);
        assert_eq!(probability_lost(3, &[1.0; 4]), 1.0);
    }

    #[test]
    fn what_cannot_be_a_function_is_named_with_its_place() {
        let functions = [
            function("pitch", &["ELEV-L", "ELEV-R"], 3),
            function("pitch", &["ELEV-L"], 1),
            function("", &["A", "A"], 0),
            function("roll", &[], 1),
        ];
        let mut invalid = Invalid::default();
        check(&functions, &mut invalid);
        let pointers: Vec<_> = invalid.violations.iter().map(|violation| violation.pointer.as_str()).collect();
        let expected = [
            "#/functions/0/needed",
            "#/functions/1/name",
            "#/functions/1/positions/0",
            "#/functions/2/name",
            "#/functions/2/needed",
            "#/functions/2/positions/1",
            "#/functions/3/positions",
        ];
        assert_eq!(pointers, expected);
    }
}
