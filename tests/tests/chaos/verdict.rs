//! What must be true of a database after all that.

use tests::{Cluster, run};

use crate::traffic::Traffic;

/// What `actuary verify --digest` says of a database: every row with a checksum was read.
pub fn digest(database: &str) -> String {
    let output = run(&["verify", "--digest", "--database-url", database]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Every upload is there once and was processed once; results of a component are in one order.
pub fn check(cluster: &Cluster, database: &str, traffic: &Traffic) {
    let count = |what: &str, sql: &str, expected: usize| {
        let found = cluster.sql(database, sql);
        println!("{what}: {found}");
        assert_eq!(found, expected.to_string(), "{what}: {sql}");
    };
    let all = traffic.len();
    count("uploads", "select count(*) from uploads", all);
    count("different uploads", "select count(distinct (operator, upload_id)) from uploads", all);
    count("names of uploads", "select count(*) from upload_keys", all);
    count("uploads that wait", "select count(*) from inbox", 0);
    count("uploads set aside", "select count(*) from set_aside", 0);
    count("estimates", "select count(*) from estimates", all);
    count("uploads with an estimate", "select count(distinct (operator, upload_id)) from estimates", all);
    count(
        "components whose inputs were not all processed",
        "select count(*) from component_queue where input_revision <> processed_revision",
        0,
    );
    // A prognosis of a later lease rests on all that an earlier one rested on, and was issued after it.
    count(
        "prognoses issued out of order",
        "select count(*) from (
           select issued_at, lag(issued_at) over life as earlier,
                  (body::json #>> '{as_of,flight_hours}')::float8 as as_of_fh,
                  lag((body::json #>> '{as_of,flight_hours}')::float8) over life as earlier_fh
           from prognoses
           window life as (partition by operator, part_number, serial_number, overhaul_index, generation order by fence)
         ) as issued where issued_at <= earlier or as_of_fh < earlier_fh",
        0,
    );
    println!("prognoses issued: {}", cluster.sql(database, "select count(*) from prognoses"));
}
