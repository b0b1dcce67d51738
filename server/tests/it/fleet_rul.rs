//! The remaining lives of the whole fleet in one list: chosen, in an order, a page at a time, the same on both transports.

use proto::{
    answer::{Page, RulAnswer},
    v1::{self, RulOrder, fleet_health_client::FleetHealthClient},
};
use serde_json::{Value, json};
use tonic::Code;
use tonic_types::StatusExt;

use crate::{due::fleet, house::House};

const RUL: &str = "/v1/fleet/rul";
const BY_RISK: [&str; 8] = ["EC-BAD", "EC-FIVE", "EC-TEN", "EC-TIE", "EC-FAR", "EC-NEW", "EC-ODD", "EC-RAW"];
const BY_DATE: [&str; 8] = ["EC-BAD", "EC-TEN", "EC-FAR", "EC-FIVE", "EC-NEW", "EC-ODD", "EC-RAW", "EC-TIE"];
const BY_PLACE: [&str; 8] = ["EC-BAD", "EC-FAR", "EC-FIVE", "EC-NEW", "EC-ODD", "EC-RAW", "EC-TEN", "EC-TIE"];

impl House {
    /// The tails of the units that a query asks for.
    async fn fleet_tails(&self, query: &str) -> Vec<String> {
        let body = self.read(&format!("{RUL}?{query}")).await;
        let items = body["items"].as_array().unwrap();
        items.iter().map(|item| item["tail"].as_str().unwrap().to_owned()).collect()
    }
}

#[tokio::test]
async fn units_come_in_the_order_that_is_asked_for() {
    let house = fleet().await;
    assert_eq!(house.fleet_tails("").await, BY_PLACE);
    assert_eq!(house.fleet_tails("sort=risk").await, BY_RISK);
    assert_eq!(house.fleet_tails("sort=date").await, BY_DATE);
    // All are certain within the horizon: even the one that contradicts itself.
    let late = house.fleet_tails("sort=risk&within_fh=10000").await;
    assert_eq!(late, ["EC-BAD", "EC-FAR", "EC-FIVE", "EC-ODD", "EC-TEN", "EC-TIE", "EC-NEW", "EC-RAW"]);
    // Within one block the quickest alone has a chance to fail.
    let soon = house.fleet_tails("sort=risk&within_fh=5").await;
    assert_eq!(soon[..2], ["EC-BAD", "EC-FIVE"]);
}

#[tokio::test]
async fn an_item_is_what_is_told_of_its_place() {
    let house = fleet().await;
    let all = house.read(&format!("{RUL}?tail=EC-TEN")).await;
    assert_eq!(all["items"], json!([house.read("/v1/tails/EC-TEN/positions/AIL-L/rul").await]));
    assert_eq!(all["next_cursor"], Value::Null);
    let within = house.read(&format!("{RUL}?tail=EC-TEN&within_fh=300")).await;
    assert_eq!(within["items"][0]["probability_of_failure"].as_array().unwrap().len(), 1);
    assert_eq!(within["items"][0], house.read("/v1/tails/EC-TEN/positions/AIL-L/rul?within_fh=300").await);
}

#[tokio::test]
async fn units_are_chosen_by_status_place_and_part() {
    let house = fleet().await;
    assert_eq!(house.fleet_tails("status=ok").await, ["EC-FAR", "EC-FIVE", "EC-TEN", "EC-TIE"]);
    assert_eq!(house.fleet_tails("status=current").await, house.fleet_tails("status=ok").await);
    assert_eq!(house.fleet_tails("status=failed,inconsistent&sort=risk").await, ["EC-BAD", "EC-ODD"]);
    assert_eq!(house.fleet_tails("status=insufficient_history").await, ["EC-NEW", "EC-RAW"]);
    assert_eq!(house.fleet_tails("status=beyond_horizon").await, [""; 0]);
    assert_eq!(house.fleet_tails("position=AIL-L&part_number=EMA-500").await, BY_PLACE);
    for none in ["position=AIL-R", "part_number=EMA-501", "tail=EC-TEN&status=failed", "tail=EC-GONE"] {
        assert_eq!(house.fleet_tails(none).await, [""; 0], "{none}");
    }
    house.wait_days(400.0);
    assert_eq!(house.fleet_tails("status=ok").await, [""; 0], "old data is not healthy");
    assert_eq!(house.fleet_tails("status=stale&sort=risk").await[..2], ["EC-FIVE", "EC-TEN"], "and keeps its numbers");
}

#[tokio::test]
async fn pages_are_the_list_on_both_transports() {
    let house = fleet().await;
    let mut grpc = FleetHealthClient::new(house.channel().await);
    let orders = [("place", RulOrder::Place), ("risk", RulOrder::Risk), ("date", RulOrder::Date)];
    for (sort, order) in orders {
        let whole: Page<RulAnswer> = serde_json::from_value(house.read(&format!("{RUL}?sort={sort}")).await).unwrap();
        for limit in [1, 3, 8] {
            let (mut told, mut cursor) = (Vec::new(), String::new());
            loop {
                let query = format!("{RUL}?sort={sort}&limit={limit}&cursor={cursor}");
                let query = if cursor.is_empty() { query.replace("&cursor=", "") } else { query };
                let page: Page<RulAnswer> = serde_json::from_value(house.read(&query).await).unwrap();
                let request = v1::ListRulRequest { sort: order.into(), limit, cursor, ..Default::default() };
                let answer = grpc.list_rul(request).await.unwrap().into_inner();
                assert_eq!(answer, page.clone().into(), "{sort} {limit}");
                told.extend(page.items);
                let Some(next) = page.next_cursor else { break };
                cursor = next;
            }
            assert_eq!(told, whole.items, "{sort} {limit}");
        }
    }
}

#[tokio::test]
async fn what_does_not_exist_is_refused_by_its_name() {
    let house = fleet().await;
    let by_risk = house.read(&format!("{RUL}?sort=risk&limit=2")).await["next_cursor"].as_str().unwrap().to_owned();
    let other_order = format!("sort=date&cursor={by_risk}");
    let cases = [
        ("sort=worst", "sort"),
        ("sort=", "sort"),
        ("status=healthy", "status"),
        ("status=ok,", "status"),
        ("tail=ec-mxa", "tail"),
        ("position=A%20B", "position"),
        ("part_number=", "part_number"),
        ("within_fh=10001", "within_fh"),
        ("within_fh=100,200", "within_fh"),
        ("limit=1001", "limit"),
        ("cursor=x", "cursor"),
        (other_order.as_str(), "cursor"),
        ("urgency=soon", "urgency"),
        ("by=2026-02-28", "by"),
        ("by=soon", "by"),
        ("check=C&within_fh=20", "within_fh"),
        ("risk=1", "risk"),
    ];
    for (query, parameter) in cases {
        let refused = house.refused(&format!("{RUL}?{query}"), 422).await;
        assert_eq!(refused["errors"][0]["parameter"], parameter, "{query}");
    }
    let mut grpc = FleetHealthClient::new(house.channel().await);
    let cases = [
        (v1::ListRulRequest { sort: 5, ..Default::default() }, "sort"),
        (v1::ListRulRequest { statuses: vec![5, 0], ..Default::default() }, "statuses"),
        (v1::ListRulRequest { tail: "x".into(), ..Default::default() }, "tail"),
        (v1::ListRulRequest { within_fh: Some(f64::NAN), ..Default::default() }, "within_fh"),
        (v1::ListRulRequest { limit: 1001, ..Default::default() }, "limit"),
        (v1::ListRulRequest { cursor: by_risk, ..Default::default() }, "cursor"),
    ];
    for (request, name) in cases {
        let refused = grpc.list_rul(request).await.unwrap_err();
        assert_eq!(refused.code(), Code::InvalidArgument);
        assert_eq!(refused.get_error_details().bad_request().unwrap().field_violations[0].field, name);
    }
}
