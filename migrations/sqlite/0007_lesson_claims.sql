-- Who takes a lesson, and when another may: a claim that ends without a prior is the pause before the next one.
-- An older build takes lessons without asking, which costs time and changes no result.
update schema_info set version = 7, min_binary = 6;

create table lesson_claims (
    operator text not null,
    part_number text not null,
    model blob not null,
    attempts integer not null,
    claimed_until integer not null,
    primary key (operator, part_number, model)
) strict, without rowid;
