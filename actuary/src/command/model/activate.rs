//! `actuary model activate`: chooses the bundle that judges.

use anyhow::Result;
use clap::{Args, ValueEnum};
use domain::{Actor, BundleSummary, ContentHash};
use store::{BundleRecord, Store};

use crate::{
    clock,
    database::Database,
    exit::Failure,
    say::{note, say},
    service::on_runtime,
};

/// Fewest characters of a hash that name a bundle.
const PREFIX: usize = 8;

/// Let a bundle judge the lives that begin from now on, or all lives.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  actuary model activate 3f9a1c07d2e4 --database-url sqlite:fleet.sqlite
  actuary model activate 3f9a1c07d2e4 --lives all

With --lives all, every life gets a new generation: workers estimate all of its uploads anew in the background,
and answers change life by life as each is complete. What answered before stays readable. To go back, activate
the bundle before with --lives all. Masks that were published stay accepted.")]
pub struct Arguments {
    /// The bundle: its hash, or the beginning of it, 8 characters or more.
    #[arg(value_name = "HASH")]
    hash: String,
    /// Which lives it judges: those that begin from now on, or all.
    #[arg(long, value_enum, default_value_t = Lives::New)]
    lives: Lives,
    #[command(flatten)]
    database: Database,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Lives {
    /// Lives that begin from now on.
    New,
    /// All lives, those that go on and those that have ended.
    All,
}

/// Activates the bundle.
pub fn run(arguments: &Arguments) -> Result<()> {
    on_runtime(async {
        let store = arguments.database.open_beside().await?;
        let activated = activate(&store, &arguments.hash, arguments.lives).await;
        store.close().await;
        activated
    })
}

async fn activate(store: &Store, name: &str, lives: Lives) -> Result<()> {
    let bundles = store.bundles().await?;
    let chosen = &named(&bundles, name)?.summary;
    let strangers = strangers(store, &bundles, chosen).await?;
    let hash = chosen.hash;
    match (lives, strangers.first()) {
        (Lives::All, Some(other)) => return Err(unreadable(chosen, other).into()),
        (Lives::New, Some(other)) => note!(
            "note: {}. A life that begins from now on needs uploads as the new bundle reads them; others are set aside.",
            unreadable(chosen, other)
        ),
        (_, None) => {}
    }
    store.activate_bundle(&hash, Actor::Cli.at(clock::system()())).await?;
    say!("{hash} judges the lives that begin from now on");
    if lives == Lives::All {
        let announced = store.judge_all_lives_by(&hash).await?;
        say!("{announced} lives wait to be judged anew by it; actuary model list shows how many are left");
    }
    Ok(())
}

/// The one bundle whose hash begins so.
fn named<'a>(bundles: &'a [BundleRecord], name: &str) -> Result<&'a BundleRecord, Failure> {
    let refuse = |reason: String| Err(Failure::BadInput(format!("model {name}: {reason}")));
    if name.len() < PREFIX {
        return refuse(format!("give {PREFIX} characters of its hash or more"));
    }
    let name = name.to_lowercase();
    let found: Vec<_> = bundles.iter().filter(|one| one.summary.hash.to_string().starts_with(&name)).collect();
    match found[..] {
        [one] => Ok(one),
        [] => refuse("there is none: actuary model list shows all, actuary model add adds one".to_owned()),
        _ => refuse(format!("{} models begin so: give more of the hash", found.len())),
    }
}

/// Bundles that judge lives now and whose uploads another one cannot read.
async fn strangers<'a>(
    store: &Store,
    bundles: &'a [BundleRecord],
    chosen: &BundleSummary,
) -> Result<Vec<&'a BundleSummary>> {
    let used: Vec<ContentHash> = store.model_use().await?.into_iter().map(|used| used.model).collect();
    let judging = bundles.iter().map(|bundle| &bundle.summary).filter(|summary| used.contains(&summary.hash));
    Ok(judging.filter(|other| !reads_alike(chosen, other)).collect())
}

/// Whether uploads made for one can be read by the other: samples of the same maps, or own faults of the same names and meaning.
fn reads_alike(one: &BundleSummary, other: &BundleSummary) -> bool {
    match (&one.measure, &other.measure) {
        (None, None) => one.masks.iter().zip(&other.masks).all(|(mask, another)| mask.reads_alike(another)),
        (Some(measure), Some(another)) => one.faults == other.faults && measure.limits == another.limits,
        _ => false,
    }
}

fn unreadable(chosen: &BundleSummary, other: &BundleSummary) -> Failure {
    Failure::BadInput(format!(
        "model {} reads {}, and lives judged by {} have uploads of {}, which it cannot read",
        chosen.hash,
        uploads(chosen),
        other.hash,
        uploads(other)
    ))
}

/// What uploads for a bundle hold.
fn uploads(summary: &BundleSummary) -> String {
    let faults = &summary.faults;
    match (&summary.measure, summary.masks.first()) {
        (Some(measure), _) => {
            let ways = faults.names.iter().zip(&faults.nominal).zip(&measure.limits);
            let way = |((name, nominal), limit): ((&String, &f64), &f64)| format!("{name} from {nominal} to {limit}");
            format!("faults of their own ({})", ways.map(way).collect::<Vec<_>>().join(", "))
        }
        (None, Some(mask)) => {
            format!("samples of maps of {} points of {}", mask.map_length(), mask.coordinate().as_str())
        }
        (None, None) => "no mask".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use domain::{Coordinate, FaultMeasure, FaultModel, Mask, Timestamp};

    use super::*;

    fn bundle(hash: &str, map_length: usize) -> BundleRecord {
        let summary = BundleSummary {
            hash: hash.repeat(8).parse().unwrap(),
            prior: ContentHash::of(b"prior"),
            faults: FaultModel::electrical(),
            masks: vec![Mask::new(Coordinate::ElectricalAngleRad, map_length, vec![1, 2]).unwrap()],
            k_nom: 0.0752,
            min_samples: 2,
            measure: None,
        };
        BundleRecord { summary, active: false, added_at: Timestamp::from_micros(0) }
    }

    #[test]
    fn a_bundle_is_named_by_the_beginning_of_its_hash_if_no_other_begins_so() {
        let bundles = [bundle("aaaabbbb", 360), bundle("aaaabbbc", 360), bundle("ccccdddd", 720)];
        assert_eq!(named(&bundles, "CCCCDDDD").unwrap(), &bundles[2]);
        assert_eq!(named(&bundles, "aaaabbbbaa").unwrap(), &bundles[0]);
        for (name, words) in [("cccc", "8 characters"), ("aaaaaaaa", "there is none"), ("aaaabbb", "8 characters")] {
            let refused = named(&bundles, name).unwrap_err().to_string();
            assert!(refused.contains(words), "{refused}");
        }
        let twice = [bundle("aaaabbbb", 360), bundle("aaaabbbb", 360)];
        assert!(named(&twice, "aaaabbbb").unwrap_err().to_string().contains("2 models begin so"));
    }

    #[test]
    fn a_bundle_of_maps_of_another_length_is_told_apart() {
        let (short, long) = (bundle("aaaabbbb", 360).summary, bundle("ccccdddd", 720).summary);
        assert!(reads_alike(&short, &bundle("eeeeffff", 360).summary));
        assert!(!reads_alike(&short, &long));
        let words = unreadable(&long, &short).to_string();
        assert!(words.contains("maps of 720 points") && words.contains("maps of 360 points"), "{words}");
    }

    #[test]
    fn own_faults_of_the_same_meaning_are_read_alike_and_samples_never() {
        let own = |limit: f64| BundleSummary {
            masks: Vec::new(),
            measure: Some(FaultMeasure { limits: vec![limit; 5], sigma: vec![0.1; 5], characteristic_life_fh: 900.0 }),
            ..bundle("eeeeffff", 360).summary
        };
        assert!(reads_alike(&own(2.0), &own(2.0)));
        assert!(!reads_alike(&own(2.0), &own(3.0)));
        let samples = bundle("aaaabbbb", 360).summary;
        assert!(!reads_alike(&own(2.0), &samples) && !reads_alike(&samples, &own(2.0)));
        assert!(unreadable(&own(2.0), &samples).to_string().contains("faults of their own (k1 from 0 to 2, "));
    }
}
