//! `FleetHealth`: tails, remaining lives, histories.

use std::str::FromStr;

use domain::{Component, Invalid, OperatorId, Position, TailNumber};
use proto::{
    grpc::{from_plan, into_assumption, into_checks, into_plan, into_settings},
    v1::{self, fleet_health_server::FleetHealth},
};
use tonic::{Request, Response, Status};

use super::Service;
use crate::{
    answer::{self, RulQuestion},
    auth::Caller,
    checks,
    due::{self, DueList},
    fleet::{self, Choice, FleetQuestion, Order, Rank},
    history::{History, Range, View, history},
    plan,
    present::Present,
    query::{grpc_hours, grpc_limit, grpc_within},
    question,
    refusal::Refusal,
    settings,
    state::State,
    what_if,
};

#[tonic::async_trait]
impl FleetHealth for Service {
    async fn list_tails(
        &self,
        request: Request<v1::ListTailsRequest>,
    ) -> Result<Response<v1::ListTailsResponse>, Status> {
        let caller = Caller::from_request(&request)?;
        let v1::ListTailsRequest { limit, cursor } = request.into_inner();
        let limit = grpc_limit(limit)?;
        let after: Option<TailNumber> = match cursor.as_str() {
            "" => None,
            text => Some(text.parse().map_err(|_| not_a_cursor())?),
        };
        let present = self.present(&caller).await?;
        Ok(Response::new(
            answer::tails(&self.0.state, &present, caller.operator(), after.as_ref(), limit).await?.into(),
        ))
    }

    async fn get_tail(&self, request: Request<v1::GetTailRequest>) -> Result<Response<v1::TailDetail>, Status> {
        let caller = Caller::from_request(&request)?;
        let tail = tail(&request.into_inner().tail)?;
        let present = self.present(&caller).await?;
        Ok(Response::new(answer::tail(&self.0.state, &present, caller.operator(), &tail).await?.into()))
    }

    async fn get_rul(&self, request: Request<v1::GetRulRequest>) -> Result<Response<v1::Rul>, Status> {
        let caller = Caller::from_request(&request)?;
        let v1::GetRulRequest { tail, position, within_fh, by, check, risk } = request.into_inner();
        let (tail, position) = place(&tail, &position)?;
        let present = self.present(&caller).await?;
        let sent = question::grpc(by, check, None, risk)?;
        let asked = RulQuestion::new(grpc_within(within_fh)?, sent, &present)?;
        let installed = answer::installed_at(&self.0.state, caller.operator(), &tail, &position).await?;
        Ok(Response::new(answer::rul(&present, &installed, &asked).into()))
    }

    async fn list_rul(&self, request: Request<v1::ListRulRequest>) -> Result<Response<v1::ListRulResponse>, Status> {
        let caller = Caller::from_request(&request)?;
        let present = self.present(&caller).await?;
        let asked = fleet_question(request.into_inner(), &present)?;
        Ok(Response::new(fleet::page(&self.0.state, &present, caller.operator(), &asked).await?.into()))
    }

    async fn list_due(&self, request: Request<v1::ListDueRequest>) -> Result<Response<v1::ListDueResponse>, Status> {
        let caller = Caller::from_request(&request)?;
        let v1::ListDueRequest { within_fh, risk, limit, cursor, by, check } = request.into_inner();
        let present = self.present(&caller).await?;
        let asked = question::grpc(by, check, within_fh, risk)?.checked(&present)?;
        let limit = grpc_limit(limit)?;
        let after = match cursor.as_str() {
            "" => None,
            text => Some(due::Place::from_cursor(text).ok_or_else(not_a_cursor)?),
        };
        let list = DueList::read(&self.0.state, &present, caller.operator(), asked).await?;
        Ok(Response::new(list.page(after.as_ref(), limit).into()))
    }

    async fn list_health(
        &self,
        request: Request<v1::ListHealthRequest>,
    ) -> Result<Response<v1::ListHealthResponse>, Status> {
        let caller = Caller::from_request(&request)?;
        let request = request.into_inner();
        let range = Range {
            from_fh: grpc_hours("from_fh", request.from_fh)?,
            to_fh: grpc_hours("to_fh", request.to_fh)?,
            life: request.life,
            generation: request.generation,
            limit: grpc_limit(request.limit)?,
        };
        let view = view(&request)?;
        let component = component(&self.0.state, caller.operator(), &request).await?;
        let page = match history(&self.0.state, &component, &range, view).await? {
            History::Estimates(page) => page.into(),
            History::States(page) => page.into(),
        };
        Ok(Response::new(page))
    }

    async fn get_plan(&self, request: Request<v1::GetPlanRequest>) -> Result<Response<v1::TailPlan>, Status> {
        let caller = Caller::from_request(&request)?;
        let tail = tail(&request.into_inner().tail)?;
        let (set, plan) = plan::get(&self.0.state, caller.operator(), &tail).await?;
        Ok(Response::new(from_plan(&tail, set, &plan)))
    }

    async fn set_plan(&self, request: Request<v1::SetPlanRequest>) -> Result<Response<v1::TailPlan>, Status> {
        let caller = Caller::from_request(&request)?;
        let now = (self.0.state.clock)();
        let (tail, plan) = into_plan(request.into_inner(), now).map_err(Refusal::from)?;
        let (set, plan) = plan::set(&self.0.state, caller.operator(), &tail, &plan, caller.at(now)).await?;
        Ok(Response::new(from_plan(&tail, set, &plan)))
    }

    async fn get_checks(&self, request: Request<v1::GetChecksRequest>) -> Result<Response<v1::TailChecks>, Status> {
        let caller = Caller::from_request(&request)?;
        let tail = tail(&request.into_inner().tail)?;
        Ok(Response::new(checks::get(&self.0.state, caller.operator(), &tail).await?.into()))
    }

    async fn set_checks(&self, request: Request<v1::SetChecksRequest>) -> Result<Response<v1::TailChecks>, Status> {
        let caller = Caller::from_request(&request)?;
        let (state, operator) = (&self.0.state, caller.operator());
        let present = state.present(operator).await.map_err(Refusal::from)?;
        let (tail, set) = into_checks(request.into_inner(), present.today()).map_err(Refusal::from)?;
        let act = caller.at((state.clock)());
        Ok(Response::new(checks::set(state, operator, &tail, set, (&present, act)).await?.into()))
    }

    async fn get_settings(
        &self,
        request: Request<v1::GetSettingsRequest>,
    ) -> Result<Response<v1::OperatorSettings>, Status> {
        let caller = Caller::from_request(&request)?;
        Ok(Response::new(settings::get(&self.0.state, caller.operator()).await?.into()))
    }

    async fn set_settings(
        &self,
        request: Request<v1::SetSettingsRequest>,
    ) -> Result<Response<v1::OperatorSettings>, Status> {
        let caller = Caller::from_request(&request)?;
        let wanted = into_settings(request.into_inner()).map_err(Refusal::from)?;
        let act = caller.at((self.0.state.clock)());
        Ok(Response::new(settings::set(&self.0.state, caller.operator(), &wanted, act).await?.into()))
    }

    async fn what_if(&self, request: Request<v1::WhatIfRequest>) -> Result<Response<v1::WhatIfResponse>, Status> {
        let caller = Caller::from_request(&request)?;
        let now = (self.0.state.clock)();
        let (tail, position, assumption) = into_assumption(request.into_inner(), now).map_err(Refusal::from)?;
        let answer = what_if::what_if(&self.0, caller.operator(), (&tail, &position), &assumption).await?;
        Ok(Response::new(answer.into()))
    }
}

impl Service {
    async fn present(&self, caller: &Caller) -> Result<Present, Refusal> {
        Ok(self.0.state.present(caller.operator()).await?)
    }
}

fn not_a_cursor() -> Refusal {
    Refusal::parameter("cursor", "must be a cursor of this call")
}

fn tail(text: &str) -> Result<TailNumber, Refusal> {
    let mut invalid = Invalid::default();
    let tail = invalid.check("#/tail", text.parse());
    Ok(invalid.into_result(tail)?)
}

fn place(tail: &str, position: &str) -> Result<(TailNumber, Position), Refusal> {
    let mut invalid = Invalid::default();
    let tail = invalid.check("#/tail", tail.parse());
    let position = invalid.check("#/position", position.parse());
    Ok(invalid.into_result(tail.zip(position))?)
}

fn fleet_question(request: v1::ListRulRequest, present: &Present) -> Result<FleetQuestion, Refusal> {
    let v1::ListRulRequest { statuses, urgencies, tail, position, part_number, sort, limit, cursor, .. } = request;
    let v1::ListRulRequest { within_fh, by, check, risk, .. } = request;
    let mut invalid = Invalid::default();
    let tail = invalid.check("#/tail", given(&tail));
    let position = invalid.check("#/position", given(&position));
    let part_number = invalid.check("#/part_number", given(&part_number));
    let names = invalid.into_result(tail.zip(position).zip(part_number));
    let ((tail, position), part_number) = names?;
    let statuses = statuses.into_iter().map(status).collect::<Result<_, _>>()?;
    let urgencies = urgencies.into_iter().map(urgency).collect::<Result<_, _>>()?;
    let order = match v1::RulOrder::try_from(sort) {
        Ok(v1::RulOrder::Unspecified | v1::RulOrder::Place) => Order::Place,
        Ok(v1::RulOrder::Risk) => Order::Risk,
        Ok(v1::RulOrder::Date) => Order::Date,
        Ok(v1::RulOrder::Urgency) => Order::Urgency,
        Err(_) => return Err(Refusal::parameter("sort", format!("{sort} must be 0, 1, 2, 3 or 4"))),
    };
    let after = match cursor.as_str() {
        "" => None,
        text => Some(Rank::from_cursor(text).ok_or_else(not_a_cursor)?),
    };
    let choice = Choice { statuses, urgencies, tail, position, part_number };
    let sent = question::grpc(by, check, within_fh, risk)?;
    let asked = RulQuestion { before: sent.checked(present)?, within_fh: within_fh.map(|hours| vec![hours]) };
    FleetQuestion { choice, order, asked, after, limit: grpc_limit(limit)? }.checked()
}

/// A name that may be left out.
fn given<T: FromStr>(text: &str) -> Result<Option<T>, T::Err> {
    (!text.is_empty()).then(|| text.parse()).transpose()
}

fn status(number: i32) -> Result<domain::Status, Refusal> {
    let known = domain::Status::ALL.into_iter().find(|status| v1::Status::from(*status) as i32 == number);
    known.ok_or_else(|| Refusal::parameter("statuses", format!("{number} must be a status from 1 to 6")))
}

fn urgency(number: i32) -> Result<domain::Urgency, Refusal> {
    let known = domain::Urgency::ALL.into_iter().find(|urgency| v1::Urgency::from(*urgency) as i32 == number);
    known.ok_or_else(|| Refusal::parameter("urgencies", format!("{number} must be an urgency from 1 to 5")))
}

fn view(request: &v1::ListHealthRequest) -> Result<View, Refusal> {
    let view = v1::HealthView::try_from(request.view)
        .map_err(|_| Refusal::parameter("view", format!("{} must be 0, 1 or 2", request.view)))?;
    let (first, after): (View, fn(&str) -> Option<View>) = match view {
        v1::HealthView::Unspecified | v1::HealthView::Estimates => (View::Estimates(None), View::estimates_after),
        v1::HealthView::States => (View::States(None), View::states_after),
    };
    match request.cursor.as_str() {
        "" => Ok(first),
        text => after(text).ok_or_else(|| Refusal::parameter("cursor", "must be a cursor of this view")),
    }
}

/// The component that is named by its place, or by itself.
async fn component(
    state: &State,
    operator: &OperatorId,
    request: &v1::ListHealthRequest,
) -> Result<Component, Refusal> {
    let v1::ListHealthRequest { tail, position, part_number, serial_number, .. } = request;
    let given = |texts: [&String; 2]| texts.iter().any(|text| !text.is_empty());
    match (given([tail, position]), given([part_number, serial_number])) {
        (true, false) => {
            let (tail, position) = place(tail, position)?;
            Ok(answer::component(operator, &answer::installed_at(state, operator, &tail, &position).await?))
        }
        (false, true) => {
            let mut invalid = Invalid::default();
            let part_number = invalid.check("#/part_number", part_number.parse());
            let serial_number = invalid.check("#/serial_number", serial_number.parse());
            let (part_number, serial_number) = invalid.into_result(part_number.zip(serial_number))?;
            let component = Component { operator: operator.clone(), part_number, serial_number };
            answer::known(state, component).await
        }
        (false, false) => Err(Refusal::parameter("tail", "name a place, or a component by its numbers")),
        (true, true) => Err(Refusal::parameter("part_number", "given although a place is named")),
    }
}
