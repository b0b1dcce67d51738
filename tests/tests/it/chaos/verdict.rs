//! What must be true of a database after all that.

use sqlx::{Connection, PgConnection};
use tests::items;

use super::{
    crew::Access,
    traffic::{OPERATORS, Traffic},
};

/// Each operator is shown all its own uploads, and nothing else.
pub async fn within_walls(access: &Access, traffic: &Traffic) {
    for (operator, name) in OPERATORS.iter().enumerate() {
        let (mut shown, mut cursor) = (Vec::new(), String::new());
        loop {
            let page = access.get(operator, &format!("/v1/uploads?state=processed&limit=1000{cursor}")).await;
            let next = page["next_cursor"].as_str().map(|next| format!("&cursor={next}"));
            shown.extend(items(page).iter().map(|item| format!("{} {}", item["upload_id"], item["flight_hours"])));
            let Some(next) = next else { break };
            cursor = next;
        }
        let own = traffic.in_order().into_iter().filter(|arrival| arrival.operator() == operator);
        let upload = |arrival| format!("{:?} {:?}", traffic.upload_id(arrival), traffic.flight_hours(arrival));
        let mut own: Vec<String> = own.map(upload).collect();
        shown.sort();
        own.sort();
        assert!(shown == own, "{name} is shown {} uploads of {}", shown.len(), own.len());
        println!("{name} is shown its {} uploads", shown.len());
    }
}

/// Every upload is there once and was processed once; results of a component are in one order.
pub async fn check(superuser: &str, traffic: &Traffic) {
    let mut connection = PgConnection::connect(superuser).await.unwrap();
    let mut count = async |what: &str, sql: &'static str, expected: usize| {
        let found: i64 = sqlx::query_scalar(sql).fetch_one(&mut connection).await.unwrap();
        println!("{what}: {found}");
        assert_eq!(found, expected as i64, "{what}: {sql}");
    };
    let all = traffic.len();
    count("uploads", "select count(*) from uploads", all).await;
    count("different uploads", "select count(distinct (operator, upload_id)) from uploads", all).await;
    count("names of uploads", "select count(*) from upload_keys", all).await;
    count("uploads that wait", "select count(*) from inbox", 0).await;
    count("uploads set aside", "select count(*) from set_aside", 0).await;
    count("estimates", "select count(*) from estimates", all).await;
    count("uploads with an estimate", "select count(distinct (operator, upload_id)) from estimates", all).await;
    count(
        "components whose inputs were not all processed",
        "select count(*) from component_queue where input_revision <> processed_revision",
        0,
    )
    .await;
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
    )
    .await;
    let issued: i64 = sqlx::query_scalar("select count(*) from prognoses").fetch_one(&mut connection).await.unwrap();
    println!("prognoses issued: {issued}");
}
