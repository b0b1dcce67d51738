//! Two operators who call their things by the same names.

use axum::{body::Body, http::Request};

use super::{
    cell::plain,
    grpc,
    names::Owner::{self, Alpha, Bravo},
    principal::{Kind, Principal},
    rest,
    world::{Inhabitant, World},
};

/// Compares what the first operator is answered while it is alone with what it is answered beside the second, whoever
/// came first, and after each change that the second makes; tells how many answers were compared, and how many changes
/// were made.
pub async fn judge_all() -> (usize, usize) {
    let named = |operator| Inhabitant { operator, names: Alpha };
    let mut alone = World::make(&[named(Alpha)]).await;
    let mut beside = World::make(&[Alpha, Bravo].map(named)).await;
    let mut compared = compare(&mut alone, &mut beside, true, "").await;
    beside = World::make(&[Bravo, Alpha].map(named)).await;
    compared += compare(&mut alone, &mut beside, true, "").await;
    let mut changes = 0;
    // Frames are by a key of their own operator, so the second cannot send those of the first; they change what uploads do.
    let is_frame = |asked: &Asked| asked.what == "POST /v1/uploads" || asked.what.ends_with("/UploadFrame");
    let changing = requests(&beside, Bravo).await.into_iter().filter(|asked| asked.changes && !is_frame(asked));
    for asked in changing {
        let answer = beside.service().answer(asked.request).await;
        assert!(answer.is_success(), "{}: {}", asked.what, plain(&answer, "", Alpha));
        beside.work().await;
        compared += compare(&mut alone, &mut beside, false, &asked.what).await;
        beside.renew().await;
        changes += 1;
    }
    (compared, changes)
}

/// Asks both worlds the same, as the first operator.
async fn compare(alone: &mut World, beside: &mut World, may_change: bool, after: &str) -> usize {
    let pairs = requests(alone, Alpha).await.into_iter().zip(requests(beside, Alpha).await);
    let mut compared = 0;
    for (one, other) in pairs.filter(|(one, _)| may_change || !one.changes) {
        let expected = plain(&alone.answer(one.request, one.changes).await, "", Bravo);
        let answer = plain(&beside.answer(other.request, other.changes).await, "", Bravo);
        assert_eq!(answer, expected, "{}, {after:?} of the other: not as without it", one.what);
        compared += 1;
    }
    compared
}

/// A request, and whether it may change anything.
struct Asked {
    what: String,
    request: Request<Body>,
    changes: bool,
}

/// All requests about the things of the common names, made by an operator's administrator.
async fn requests(world: &World, of: Owner) -> Vec<Asked> {
    let is_admin = |principal: &&Principal| principal.owner == Some(of) && principal.kind == Kind::Admin;
    let admin = world.principals.iter().find(is_admin).expect("each has one");
    let over_grpc = grpc::methods().into_iter().map(|path| {
        let request = grpc::request(&path, &grpc::message(&path, Alpha), admin);
        (request, grpc::changes(&path))
    });
    let over_rest = rest::requests(world, Alpha, admin).await;
    let asked = |(request, changes): (Request<Body>, bool)| Asked {
        what: format!("{} {}", request.method(), request.uri()),
        request,
        changes,
    };
    over_rest.into_iter().chain(over_grpc).map(asked).collect()
}
