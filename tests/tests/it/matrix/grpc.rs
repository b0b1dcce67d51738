//! gRPC methods: generated from the descriptors that the service publishes.

use axum::{
    body::Body,
    http::{Method, Request},
};
use prost::Message;
use prost_types::FileDescriptorSet;
use proto::{grpc::from_upload, v1};

use super::{
    cell::{keep_silent, plain},
    expectation::{Allowed, Expectation, of_grpc},
    names::Owner,
    principal::{Kind, Principal},
    world::{self, World},
};
use crate::in_process::service::Answer;

/// Goes through all methods, callers and things; tells how many answers were judged.
pub async fn judge_all(world: &mut World) -> usize {
    let mut cells = 0;
    for path in methods() {
        let expectation = of_grpc(&path);
        for principal in world.principals.clone() {
            judge(world, &path, expectation, &principal).await;
            cells += 3;
        }
    }
    cells
}

/// The paths of all methods of the service.
pub fn methods() -> Vec<String> {
    let descriptors = FileDescriptorSet::decode(proto::FILE_DESCRIPTOR_SET).expect("the descriptors of this build");
    let mut methods = Vec::new();
    for file in &descriptors.file {
        for service in &file.service {
            let path = |method: &str| format!("/{}.{}/{method}", file.package(), service.name());
            methods.extend(service.method.iter().map(|method| path(method.name())));
        }
    }
    assert!(methods.len() > 8, "{methods:?}");
    methods
}

async fn judge(world: &mut World, path: &str, expectation: Expectation, principal: &Principal) {
    let own = principal.owner.unwrap_or(Owner::Alpha);
    let [mine, others, ghosts] = [own, own.other(), own.other().ghost()].map(|of| message(path, of));
    let cell = format!("{:?} of {:?}: {path}", principal.kind, principal.owner);
    let answer = call(world, path, &mine, principal).await;
    let Expectation { allowed, success, other_tail } = expectation;
    let expected = match principal.kind {
        kind if !kind.is_known() => 16,
        kind if !allowed.admits(kind) => 7,
        Kind::AircraftTwo if allowed == Allowed::Uploaders => other_tail,
        _ => success,
    };
    // What is asked about has a forecast only after some uploads: until then there is nothing to vary.
    let waits = path.ends_with("/WhatIf") && code(&answer) == 9 && expected == success;
    assert_eq!(if waits { success } else { code(&answer) }, expected, "{cell}: {}", plain(&answer, "", own));
    keep_silent(&answer, &text(&mine), own.other(), &cell);
    let to_other = call(world, path, &others, principal).await;
    let to_ghost = call(world, path, &ghosts, principal).await;
    keep_silent(&to_other, &text(&others), own.other(), &cell);
    let about_other = plain(&to_other, &text(&others), own.other());
    assert_eq!(about_other, plain(&to_ghost, &text(&ghosts), own.other().ghost()), "{cell}: as what does not exist");
}

/// A message about an owner's things, by the method.
pub fn message(path: &str, of: Owner) -> Vec<u8> {
    match path.rsplit('/').next().expect("a method") {
        "Upload" | "UploadStream" => {
            let upload = world::upload(of, 1, 50).into_upload(of.tail(1).parse().expect("a tail"));
            from_upload(upload.expect("an upload")).encode_to_vec()
        }
        "UploadFrame" => v1::UploadFrameRequest { frame: world::frame(of), strain_frame: Vec::new() }.encode_to_vec(),
        "ListTails" => v1::ListTailsRequest { limit: 2, cursor: String::new() }.encode_to_vec(),
        "GetTail" => v1::GetTailRequest { tail: of.tail(1) }.encode_to_vec(),
        "GetRul" => {
            v1::GetRulRequest { tail: of.tail(1), position: of.position(), ..Default::default() }.encode_to_vec()
        }
        "ListHealth" => {
            v1::ListHealthRequest { part_number: of.part(), serial_number: of.serial(1), ..Default::default() }
                .encode_to_vec()
        }
        "ListRul" => v1::ListRulRequest { sort: v1::RulOrder::Risk.into(), tail: of.tail(1), ..Default::default() }
            .encode_to_vec(),
        "ListDue" => v1::ListDueRequest::default().encode_to_vec(),
        "GetPlan" => v1::GetPlanRequest { tail: of.tail(1) }.encode_to_vec(),
        "SetPlan" => v1::SetPlanRequest { tail: of.tail(1), stretches: Vec::new() }.encode_to_vec(),
        "GetChecks" => v1::GetChecksRequest { tail: of.tail(1) }.encode_to_vec(),
        "SetChecks" => v1::SetChecksRequest { tail: of.tail(1), checks: Vec::new() }.encode_to_vec(),
        "GetSettings" => v1::GetSettingsRequest {}.encode_to_vec(),
        "SetSettings" => v1::SetSettingsRequest { risk: Some(0.07), ..Default::default() }.encode_to_vec(),
        "WhatIf" => {
            v1::WhatIfRequest { tail: of.tail(1), position: of.position(), ..Default::default() }.encode_to_vec()
        }
        "List" => v1::ListModelsRequest {}.encode_to_vec(),
        "GetMask" => v1::GetMaskRequest::default().encode_to_vec(),
        _ => panic!("{path}: there is no message for it yet"),
    }
}

/// What a message tells, readable.
fn text(message: &[u8]) -> String {
    message.iter().map(|&byte| char::from(byte)).collect()
}

/// A call of a method.
pub fn request(path: &str, message: &[u8], principal: &Principal) -> Request<Body> {
    let mut framed = vec![0];
    framed.extend((message.len() as u32).to_be_bytes());
    framed.extend(message);
    let request = Request::builder().method(Method::POST).uri(path).header("te", "trailers");
    let request = principal.signs(request.header("content-type", "application/grpc"));
    request.body(Body::from(framed)).expect("a path")
}

/// Whether a method may change anything.
pub fn changes(path: &str) -> bool {
    path.starts_with("/actuary.v1.Ingest/") || path.contains("/Set")
}

async fn call(world: &mut World, path: &str, message: &[u8], principal: &Principal) -> Answer {
    world.answer(request(path, message, principal), changes(path)).await
}

fn code(answer: &Answer) -> u16 {
    let status = answer.headers.get("grpc-status").and_then(|value| value.to_str().ok());
    status.and_then(|status| status.parse().ok()).expect("every gRPC answer has a status")
}
