-- Tokens and the audit log. A build that ignores tokens would answer everyone.
update schema_info set version = 4, min_binary = 4;

-- Tokens are never deleted: that there is one means that callers must show one. secret_hash: SHA-256.
-- scope: 'aircraft' (then tail is not null), 'ops', 'planner' or 'admin'.
create table tokens (
    token_id text not null primary key,
    operator text not null,
    scope text not null,
    tail text,
    name text,
    secret_hash blob not null,
    created_at integer not null,
    expires_at integer,
    revoked_at integer,
    checksum blob not null
) strict, without rowid;
create index tokens_of_operator on tokens (operator, created_at, token_id);

-- Append-only: one chain per operator, and that of the installation, whose operator is ''. hash: of the
-- body, which holds the hash of the record before it.
create table audit (
    operator text not null,
    sequence integer not null,
    body text not null,
    hash blob not null,
    primary key (operator, sequence)
) strict;
