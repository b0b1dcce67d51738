//! Options that choose the links of the diagnosis chain.

use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};
use pipeline::ChainSettings;
use serde::de::{
    DeserializeOwned, IntoDeserializer,
    value::{Error, StrDeserializer},
};

/// A chain by its name, and links that differ from it.
#[derive(Debug, Args)]
#[command(next_help_heading = "Links of the diagnosis")]
pub struct ChainArguments {
    /// The whole chain by its name.
    #[arg(long, default_value = "default", value_parser = PossibleValuesParser::new(ChainSettings::NAMES))]
    chain: String,
    /// Form of the model that makes the maps to learn from.
    #[arg(long, value_name = "FORM", conflicts_with = "dataset", value_parser = named::<pipeline::Lf1Form>(&["pair", "thesis"]))]
    lf1: Option<pipeline::Lf1Form>,
    /// How the points of the mask are chosen.
    #[arg(long, value_name = "RULE", value_parser = named::<pipeline::MaskRule>(&["d-optimal", "qr", "som", "uniform"]))]
    mask: Option<pipeline::MaskRule>,
    /// How coefficients are found from samples: with the prior of the basis (map), or without.
    #[arg(long, value_name = "FIT", value_parser = named::<pipeline::GappyPrior>(&["map", "least-squares"]))]
    gappy: Option<pipeline::GappyPrior>,
    /// Modes of the basis.
    #[arg(long, value_parser = clap::value_parser!(u8).range(2..=20))]
    modes: Option<u8>,
    /// Hidden units of the network.
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=100))]
    hidden: Option<u8>,
    /// Whether the network learns from noisy samples.
    #[arg(long, value_name = "BOOL")]
    noise_training: Option<bool>,
    /// Which map is read.
    #[arg(long, value_name = "KIND", value_parser = named::<pipeline::MapKind>(&["load-invariant", "raw"]))]
    map: Option<pipeline::MapKind>,
}

impl ChainArguments {
    /// The chain of that name with the links that were given.
    pub fn settings(&self) -> ChainSettings {
        let chain = ChainSettings::named(&self.chain).expect("the parser knows the names");
        ChainSettings {
            lf1: self.lf1.unwrap_or(chain.lf1),
            mask: self.mask.unwrap_or(chain.mask),
            gappy: self.gappy.unwrap_or(chain.gappy),
            modes: self.modes.map_or(chain.modes, usize::from),
            hidden: self.hidden.map_or(chain.hidden, usize::from),
            noise_training: self.noise_training.unwrap_or(chain.noise_training),
            map: self.map.unwrap_or(chain.map),
        }
    }
}

/// Reads a link by the name that it has in files.
fn named<T: DeserializeOwned + Clone + Send + Sync + 'static>(
    names: &'static [&'static str],
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(names).try_map(|name| {
        let text: StrDeserializer<Error> = name.as_str().into_deserializer();
        T::deserialize(text)
    })
}
