-- Tokens and the audit log. A build that ignores tokens would answer everyone.
update schema_info set version = 4, min_binary = 4;

-- Tokens are never deleted: that there is one means that callers must show one. secret_hash: SHA-256.
-- scope: 'aircraft' (then tail is not null), 'ops', 'planner' or 'admin'.
create table tokens (
    token_id text collate "C" not null primary key,
    operator text collate "C" not null,
    scope text collate "C" not null,
    tail text collate "C",
    name text collate "C",
    secret_hash bytea not null,
    created_at bigint not null,
    expires_at bigint,
    revoked_at bigint,
    checksum bytea not null
);
create index tokens_of_operator on tokens (operator, created_at, token_id);
select wall('tokens', 'select, insert, update');
select across('tokens', 'select');

-- Append-only: one chain per operator, and that of the installation, whose operator is ''. hash: of the
-- body, which holds the hash of the record before it.
create table audit (
    operator text collate "C" not null,
    sequence bigint not null,
    body text not null,
    hash bytea not null,
    primary key (operator, sequence)
);
select wall('audit', 'select, insert');
select across('audit', 'select (operator)');
