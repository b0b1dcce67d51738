//! Compiles the protobuf files without protoc.

use std::{env, error::Error, fs, path::PathBuf};

use protox::prost::Message;

const FILES: [&str; 3] = ["actuary/v1/ingest.proto", "actuary/v1/fleet_health.proto", "actuary/v1/models.proto"];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=actuary");
    let descriptors = protox::compile(FILES, ["."])?;
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out.join("actuary.v1.bin"), descriptors.encode_to_vec())?;
    // Clients bring their own channel, so that the server does not link a client transport.
    tonic_prost_build::configure().build_transport(false).btree_map(".").compile_fds(descriptors)?;
    Ok(())
}
