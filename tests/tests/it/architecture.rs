//! The workspace has layers: each crate may use the crates named here and no others, and the pure
//! crates reach no runtime, database or network. ARCHITECTURE.md says why.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
};

use cargo_metadata::{CargoOpt, DependencyKind, Metadata, MetadataCommand};

/// Each crate with the crates of the workspace that it may depend on.
const ALLOWED: &[(&str, &[&str])] = &[
    ("numerics", &[]),
    ("domain", &["numerics"]),
    ("ema", &["numerics", "domain"]),
    ("airframe", &["numerics", "domain"]),
    ("reduction", &["numerics", "domain"]),
    ("diagnosis", &["numerics", "domain", "reduction"]),
    ("prognosis", &["numerics", "domain"]),
    ("evaluation", &["numerics", "domain", "prognosis"]),
    ("pipeline", &["numerics", "domain", "ema", "airframe", "reduction", "diagnosis", "prognosis"]),
    ("metric", &[]),
    ("store", &["domain", "metric"]),
    ("proto", &["domain"]),
    ("server", &["domain", "metric", "proto", "store"]),
    ("worker", &["domain", "metric", "pipeline", "store"]),
    ("simulator", &["numerics", "domain", "ema", "airframe", "proto"]),
    (
        "actuary",
        &[
            "numerics",
            "domain",
            "airframe",
            "ema",
            "evaluation",
            "pipeline",
            "prognosis",
            "proto",
            "server",
            "simulator",
            "store",
            "worker",
        ],
    ),
    ("tests", &[]),
];

/// The crates that do no I/O, and what must stay out of everything that they link.
const PURE: &[&str] =
    &["numerics", "domain", "ema", "airframe", "reduction", "diagnosis", "prognosis", "evaluation", "pipeline"];
const IMPURE: &[&str] = &["tokio", "sqlx", "axum", "hyper", "tonic", "reqwest", "mio", "rand", "getrandom"];

fn metadata() -> Metadata {
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.toml");
    MetadataCommand::new().manifest_path(manifest).features(CargoOpt::AllFeatures).exec().expect("cargo metadata runs")
}

/// The folder of each crate.
pub fn folders() -> Vec<PathBuf> {
    let members = metadata();
    members
        .workspace_packages()
        .iter()
        .map(|package| package.manifest_path.parent().expect("a folder").into())
        .collect()
}

#[test]
fn crates_depend_only_on_the_floors_below() {
    let metadata = metadata();
    let allowed: BTreeMap<_, BTreeSet<_>> =
        ALLOWED.iter().map(|(name, below)| (*name, below.iter().copied().collect())).collect();
    let members = metadata.workspace_packages();
    let names: BTreeSet<_> = members.iter().map(|package| package.name.as_str()).collect();
    assert_eq!(names, allowed.keys().copied().collect(), "every crate has its row in ALLOWED");
    for package in members {
        for dependency in package.dependencies.iter().filter(|d| d.kind != DependencyKind::Development) {
            let name = dependency.name.as_str();
            assert!(
                !names.contains(name) || allowed[package.name.as_str()].contains(name),
                "{} may not depend on {name}",
                package.name
            );
        }
    }
}

#[test]
fn pure_crates_link_no_runtime_database_or_network() {
    let metadata = metadata();
    let graph = metadata.resolve.as_ref().expect("a resolved graph");
    let nodes: BTreeMap<_, _> = graph.nodes.iter().map(|node| (&node.id, node)).collect();
    let name_of: BTreeMap<_, _> =
        metadata.packages.iter().map(|package| (&package.id, package.name.as_str())).collect();
    for package in metadata.workspace_packages().iter().filter(|p| PURE.contains(&p.name.as_str())) {
        let mut open = vec![&package.id];
        let mut reached = BTreeSet::new();
        while let Some(id) = open.pop() {
            let normal = |d: &&cargo_metadata::NodeDep| d.dep_kinds.iter().any(|k| k.kind == DependencyKind::Normal);
            open.extend(nodes[id].deps.iter().filter(normal).map(|d| &d.pkg).filter(|id| reached.insert(*id)));
        }
        let reached: BTreeSet<_> = reached.into_iter().map(|id| name_of[id]).collect();
        let impure: Vec<_> = IMPURE.iter().filter(|name| reached.contains(*name)).collect();
        assert!(impure.is_empty(), "{} reaches {impure:?}", package.name);
    }
}

#[test]
fn no_crate_compiles_foreign_tls_or_openssl() {
    let names: BTreeSet<_> = metadata().packages.iter().map(|package| package.name.to_string()).collect();
    for banned in ["aws-lc-sys", "openssl-sys"] {
        assert!(!names.contains(banned), "{banned} needs more than a C compiler");
    }
}
