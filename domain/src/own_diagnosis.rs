//! An own diagnosis: faults, or another index of health, that somebody else than a bundle found.

use std::{collections::BTreeMap, fmt};

use serde::{
    Deserialize, Deserializer, Serialize,
    de::{Error, MapAccess, Visitor},
};

use crate::{BundleSummary, Diagnosis, FaultMeasure, FaultVector, Invalid, invalid, range::Range};

/// How many times the least standard deviation goes into the way from nominal to the limit: below it, squares lose what
/// they add to.
const FINEST: f64 = 1e6;
/// How far a value may lie from nominal, and the greatest standard deviation, in ways from nominal to the limit.
const FARTHEST: f64 = 10.0;

/// Faults by name, each given once.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(transparent)]
pub struct OwnDiagnosis(BTreeMap<String, OwnFault>);

/// One fault of an own diagnosis, in the fault's own unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object of a value and its sigma")]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema), schema(as = OwnFaultBody))]
pub struct OwnFault {
    /// The value, nominal value included.
    #[cfg_attr(feature = "schema", schema(example = 0.031))]
    pub value: f64,
    /// Its standard deviation, above zero; the bundle's usual one where it is not told and the bundle has one.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    #[cfg_attr(feature = "schema", schema(example = 0.0041))]
    pub sigma: Option<f64>,
}

impl OwnDiagnosis {
    /// The fault of a name.
    pub fn get(&self, name: &str) -> Option<&OwnFault> {
        self.0.get(name)
    }

    /// The names, in their order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// The diagnosis as a bundle has its faults, or what is wrong with it.
    pub fn diagnosis(&self, bundle: &BundleSummary) -> Result<Diagnosis, Invalid> {
        let usual = |i: usize| bundle.measure.as_ref().map(|measure| measure.sigma[i]);
        let figures = |(i, name): (usize, &String)| {
            let OwnFault { value, sigma } = self.get(name)?;
            Some((*value, sigma.or_else(|| usual(i))?))
        };
        let figures: Option<(Vec<f64>, Vec<f64>)> = bundle.faults.names.iter().enumerate().map(figures).collect();
        let diagnosis = |(values, sigma)| Diagnosis { fault_vector: FaultVector(values), sigma, fit: None };
        self.violations(bundle).into_result(figures.map(diagnosis))
    }

    /// What is wrong with it for a bundle: the names must be those of its faults, values and standard deviations must
    /// be ones that they can have.
    pub fn violations(&self, bundle: &BundleSummary) -> Invalid {
        let mut wrong = Invalid::default();
        let known = &bundle.faults.names;
        for name in self.names().filter(|name| !known.iter().any(|known| known == name)) {
            wrong.push(pointer(name), format!("no such fault: the bundle knows {}", known.join(", ")));
        }
        for (i, name) in known.iter().enumerate() {
            match self.get(name) {
                None => wrong.push(pointer(name), "missing"),
                Some(fault) => fault.judge(&pointer(name), &Scale::of(bundle, i), &mut wrong),
            }
        }
        wrong
    }
}

impl OwnFault {
    fn judge(&self, pointer: &str, scale: &Scale, wrong: &mut Invalid) {
        if let Some(refusal) = scale.value.refusal(self.value) {
            wrong.push(format!("{pointer}/value"), refusal);
        }
        match self.sigma {
            None if !scale.tells_sigma => {
                wrong.push(format!("{pointer}/sigma"), "missing: the bundle tells no usual one");
            }
            sigma => {
                if let Some(refusal) = sigma.and_then(|sigma| scale.sigma.refusal(sigma)) {
                    wrong.push(format!("{pointer}/sigma"), refusal);
                }
            }
        }
    }
}

/// What a fault's figures can be.
struct Scale {
    value: Range,
    sigma: Range,
    tells_sigma: bool,
}

impl Scale {
    fn of(bundle: &BundleSummary, fault: usize) -> Self {
        match &bundle.measure {
            None => {
                let sigma = Range { min: 1.0 / FINEST, max: 1.0, unit: "" };
                Self { value: Range { min: 0.0, max: 1.0, unit: "" }, sigma, tells_sigma: false }
            }
            Some(FaultMeasure { limits, .. }) => {
                let nominal = bundle.faults.nominal[fault];
                let way = (limits[fault] - nominal).abs();
                let (min, max) = (nominal - FARTHEST * way, nominal + FARTHEST * way);
                let unit = "in the fault's own unit, ten ways from nominal to the limit on either side";
                let sigma = Range { min: way / FINEST, max: FARTHEST * way, unit: "in the fault's own unit" };
                Self { value: Range { min, max, unit }, sigma, tells_sigma: true }
            }
        }
    }
}

fn pointer(name: &str) -> String {
    format!("#/faults/{}", invalid::step(name))
}

impl FromIterator<(String, OwnFault)> for OwnDiagnosis {
    fn from_iter<I: IntoIterator<Item = (String, OwnFault)>>(faults: I) -> Self {
        Self(faults.into_iter().collect())
    }
}

impl IntoIterator for OwnDiagnosis {
    type Item = (String, OwnFault);
    type IntoIter = std::collections::btree_map::IntoIter<String, OwnFault>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

impl<'de> Deserialize<'de> for OwnDiagnosis {
    fn deserialize<D: Deserializer<'de>>(reader: D) -> Result<Self, D::Error> {
        reader.deserialize_map(Once)
    }
}

/// Takes an object whose keys are given once each.
struct Once;

impl<'de> Visitor<'de> for Once {
    type Value = OwnDiagnosis;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an object of faults by name")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<OwnDiagnosis, A::Error> {
        let mut faults = BTreeMap::new();
        while let Some((name, fault)) = map.next_entry::<String, OwnFault>()? {
            if faults.contains_key(&name) {
                return Err(A::Error::custom(format!("duplicate field `{name}`")));
            }
            faults.insert(name, fault);
        }
        Ok(OwnDiagnosis(faults))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ContentHash, FaultModel, json};

    fn bundle() -> BundleSummary {
        BundleSummary {
            hash: ContentHash::of(b"bundle"),
            prior: ContentHash::of(b"prior"),
            faults: FaultModel::electrical(),
            masks: Vec::new(),
            k_nom: 0.07,
            min_samples: 11,
            measure: None,
        }
    }

    /// A crack that fails at 49.8 mm, from 9 mm on, and a health index that falls from 1 to 0.2.
    fn own() -> BundleSummary {
        let measure = FaultMeasure { limits: vec![49.8, 0.2], sigma: vec![0.2, 0.01], characteristic_life_fh: 5000.0 };
        let faults =
            FaultModel { names: vec!["crack/mm".into(), "index".into()], nominal: vec![9.0, 1.0], groups: vec![] };
        BundleSummary { faults, measure: Some(measure), ..bundle() }
    }

    fn told(json: &str, bundle: &BundleSummary) -> Vec<String> {
        let diagnosis: OwnDiagnosis = json::from_slice(json.as_bytes()).unwrap();
        diagnosis.violations(bundle).violations.into_iter().map(|v| v.pointer).collect()
    }

    const FIVE: &str = r#"{"k1":{"value":0.1,"sigma":0.01},"k2":{"value":0,"sigma":0.01},"k3":{"value":1,"sigma":1},
        "k4":{"value":0.5,"sigma":0.01},"k5":{"value":0.5,"sigma":1e-6}}"#;

    #[test]
    fn the_faults_of_the_bundle_are_taken_and_no_others() {
        assert!(told(FIVE, &bundle()).is_empty());
        assert_eq!(told(&FIVE.replace("k3", "k9"), &bundle()), ["#/faults/k9", "#/faults/k3"]);
        assert_eq!(told("{}", &bundle()).len(), 5);
        let names = ["#/faults/k1", "#/faults/k2", "#/faults/k3", "#/faults/k4", "#/faults/k5"];
        assert_eq!(told(FIVE, &own()), [&names[..], &["#/faults/crack~1mm", "#/faults/index"]].concat());
    }

    #[test]
    fn figures_that_no_fault_has_are_named() {
        for (from, to, field) in [
            (r#""value":0.1"#, r#""value":1.0001"#, "value"),
            (r#""value":0.1"#, r#""value":-1e-9"#, "value"),
            (r#""sigma":0.01"#, r#""sigma":0"#, "sigma"),
            (r#""sigma":0.01"#, r#""sigma":-0.01"#, "sigma"),
            (r#""sigma":0.01"#, r#""sigma":1e-200"#, "sigma"),
            (r#""sigma":0.01"#, r#""sigma":1.1"#, "sigma"),
            (r#","sigma":0.01"#, "", "sigma"),
        ] {
            assert_eq!(told(&FIVE.replacen(from, to, 1), &bundle()), [format!("#/faults/k1/{field}")], "{to}");
        }
        let mut not_numbers = json::from_slice::<OwnDiagnosis>(FIVE.as_bytes()).unwrap();
        not_numbers.0.insert("k2".to_owned(), OwnFault { value: f64::NAN, sigma: Some(f64::INFINITY) });
        let told = not_numbers.violations(&bundle()).violations;
        assert_eq!([&told[0].pointer, &told[1].pointer], ["#/faults/k2/value", "#/faults/k2/sigma"]);
    }

    #[test]
    fn own_faults_reach_as_far_as_their_limits_say_and_have_a_usual_error() {
        let at = |crack: f64, index: f64| format!(r#"{{"crack/mm":{{"value":{crack}}},"index":{{"value":{index}}}}}"#);
        assert!(told(&at(9.0, 1.0), &own()).is_empty());
        assert!(told(&at(9.0 - 407.0, 8.9), &own()).is_empty(), "noise, or a life beyond its limit");
        assert_eq!(told(&at(418.0, 9.1), &own()), ["#/faults/crack~1mm/value", "#/faults/index/value"]);
        let sigma = |sigma: f64| at(9.0, 1.0).replacen('}', &format!(",\"sigma\":{sigma}}}"), 1);
        assert!(told(&sigma(40.0), &own()).is_empty());
        assert_eq!(told(&sigma(1e-5), &own()), ["#/faults/crack~1mm/sigma"]);
    }

    #[test]
    fn a_diagnosis_has_the_order_of_the_bundle_and_its_usual_error_where_none_is_told() {
        let read = |json: &str, bundle: &BundleSummary| {
            json::from_slice::<OwnDiagnosis>(json.as_bytes()).unwrap().diagnosis(bundle)
        };
        let found = read(r#"{"index":{"value":0.7,"sigma":0.05},"crack/mm":{"value":-3}}"#, &own()).unwrap();
        let expected = Diagnosis { fault_vector: FaultVector(vec![-3.0, 0.7]), sigma: vec![0.2, 0.05], fit: None };
        assert_eq!(found, expected);
        assert!(read(r#"{"index":{"value":0.7}}"#, &own()).is_err());
        assert!(read(FIVE, &bundle()).is_ok() && read(FIVE, &own()).is_err());
    }

    #[test]
    fn a_name_is_given_once_and_a_fault_is_an_object() {
        let refused = |json: &str| json::from_slice::<OwnDiagnosis>(json.as_bytes()).unwrap_err().to_string();
        assert!(refused(r#"{"k1":{"value":1},"k1":{"value":1}}"#).contains("duplicate field `k1`"));
        for json in [r#"{"k1":1}"#, r#"{"k1":[1,0.1]}"#, r#"[["k1",1]]"#, r#"{"k1":{"value":1,"sd":1}}"#, "null"] {
            refused(json);
        }
    }
}
