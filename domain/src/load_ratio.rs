//! The load ratio of an upload.

use std::fmt;

use serde::{
    Deserialize, Deserializer, Serialize,
    de::{SeqAccess, Visitor},
};

/// The load ratio of the samples: a number or a list.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema), schema(as = LoadRatioBody))]
pub enum LoadRatio {
    /// The mean of the whole map: worse than one per sample.
    Mean(f64),
    /// One per sample, missing where the sample is.
    PerSample(Vec<Option<f64>>),
}

impl LoadRatio {
    /// Mean size; `None` where there is none.
    pub fn mean_size(&self) -> Option<f64> {
        match self {
            Self::Mean(ratio) => Some(ratio.abs()),
            Self::PerSample(ratios) => {
                let known = ratios.iter().flatten();
                let count = known.clone().count();
                (count > 0).then(|| known.map(|ratio| ratio.abs()).sum::<f64>() / count as f64)
            }
        }
    }
}

/// By hand, because an untagged enum loses the path to the element at fault.
impl<'de> Deserialize<'de> for LoadRatio {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrList;
        impl<'de> Visitor<'de> for NumberOrList {
            type Value = LoadRatio;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number or a list of numbers")
            }

            fn visit_f64<E>(self, mean: f64) -> Result<Self::Value, E> {
                Ok(LoadRatio::Mean(mean))
            }

            fn visit_u64<E>(self, mean: u64) -> Result<Self::Value, E> {
                Ok(LoadRatio::Mean(mean as f64))
            }

            fn visit_i64<E>(self, mean: i64) -> Result<Self::Value, E> {
                Ok(LoadRatio::Mean(mean as f64))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
                let mut ratios = Vec::new();
                while let Some(ratio) = list.next_element()? {
                    ratios.push(ratio);
                }
                Ok(LoadRatio::PerSample(ratios))
            }
        }
        deserializer.deserialize_any(NumberOrList)
    }
}
