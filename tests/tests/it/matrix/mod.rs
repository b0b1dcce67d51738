//! Every endpoint with every kind of caller: who may not is refused, and nobody learns anything of another operator.
//!
//! REST endpoints are generated from the OpenAPI document, pages from the list of the service, gRPC methods from their
//! descriptors: one that is new fails here until `expectation` says who may call it, and what to call it with. Each
//! request is made about things of the caller's own operator, of the other one, and of nobody: the last two must be
//! answered alike to the byte, apart from the names that the request itself tells. All names and texts of an
//! operator carry its word, which must appear nowhere else.
//!
//! Then both operators call all their things alike: what one is answered must be the same as if the other were not
//! there, and whatever the other changes.

mod cell;
mod expectation;
mod grpc;
mod names;
mod principal;
mod rest;
mod twins;
mod world;

use names::Owner::{Alpha, Bravo};
use world::{Inhabitant, World};

#[tokio::test]
async fn nobody_learns_anything_of_another_operator_over_rest() {
    let mut world = World::make(&[Alpha, Bravo].map(Inhabitant::called_by_its_own)).await;
    let cells = rest::judge_all(&mut world).await;
    println!("{cells} answers of REST and pages judged, {} worlds", world.renewals + 1);
    assert!(cells > 1000, "{cells}");
}

#[tokio::test]
async fn nobody_learns_anything_of_another_operator_over_grpc() {
    let mut world = World::make(&[Alpha, Bravo].map(Inhabitant::called_by_its_own)).await;
    let cells = grpc::judge_all(&mut world).await;
    println!("{cells} answers of gRPC judged, {} worlds", world.renewals + 1);
    assert!(cells > 300, "{cells}");
}

#[tokio::test]
async fn what_one_is_answered_does_not_depend_on_another_of_the_same_names() {
    let (compared, changes) = twins::judge_all().await;
    println!("{compared} answers compared, {changes} changes of the other operator");
    assert!(compared > 300 && changes > 8, "{compared}, {changes}");
}
