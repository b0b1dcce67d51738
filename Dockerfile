# The image of every process of Actuary: server, worker, migration. It holds the binary and the C library, no shell.
FROM rust:1.95-slim-bookworm AS build
WORKDIR /src
COPY . .
ENV CARGO_INCREMENTAL=0 RUSTFLAGS="--remap-path-prefix=/src=. --remap-path-prefix=/usr/local/cargo=cargo"
RUN --mount=type=cache,target=/usr/local/cargo/registry \
    --mount=type=cache,target=/src/target \
    cargo build --release --locked --bin actuary && \
    install -D --strip target/release/actuary /image/usr/local/bin/actuary
# The loader and the libraries that the binary names, and a place for temporary files.
RUN ldd /image/usr/local/bin/actuary | grep -o '/[^ ]*' | xargs -I {} cp --parents --dereference {} /image && \
    install -d -m 1777 /image/tmp

FROM scratch
COPY --from=build /image /
USER 65532:65532
EXPOSE 8080
ENTRYPOINT ["/usr/local/bin/actuary"]
CMD ["--help"]
