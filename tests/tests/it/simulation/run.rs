//! One seed from its first request to the comparison with the reference.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use domain::OperatorId;
use store::Lease;

use super::{
    dice::Dice,
    hands::{Hands, LEASE, Stepped},
    input::{Input, get},
    ledger::Ledger,
    mix::Mix,
    network::{Packet, Way, deliver},
    operators::{self, Keyring},
    question::{Question, keeps_within},
    reference,
    story::{self, Teller},
};
use crate::in_process::{
    clock::Clock,
    database::Database,
    service::{Bundle, Service},
};

/// Most steps until everything must have been acknowledged.
const MOST_STEPS: usize = 20_000;
/// More than any worker's back-off, and than the longest lease of a dead one, seconds.
const PATIENCE_S: f64 = 1000.0;

/// How often each thing happened.
pub type Tally = BTreeMap<&'static str, u64>;

/// What a run came to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// How often each thing happened.
    pub tally: Tally,
    /// The digest of all results in the end.
    pub digest: String,
}

/// Runs one seed; panics where something does not hold.
pub async fn run(seed: u64, mix: Mix, database: Database) -> Outcome {
    let mut run = Run::begin(seed, mix, database).await;
    println!("seed {seed}: {:?}", run.mix);
    run.go_on().await;
    run.mix = run.mix.healed();
    run.settle().await;
    run.conclude().await
}

/// A run under way.
struct Run {
    mix: Mix,
    dice: Dice,
    clock: Clock,
    database: Database,
    service: Service,
    hands: Vec<Hands>,
    keys: Keyring,
    ledger: Ledger,
    orders: Vec<Input>,
    /// Numbers of the orders that each operator has not sent, or not seen answered.
    waiting: Vec<VecDeque<usize>>,
    network: Vec<Packet>,
    tally: Tally,
}

/// What happens next.
#[derive(Debug, Clone, Copy)]
enum Step {
    Send,
    Deliver,
    Work,
    Ask,
    Restart,
    Leap,
    Rest,
    Activate,
    Rotate,
}

impl Run {
    async fn begin(seed: u64, mix: Mix, database: Database) -> Self {
        let clock = Clock::at(story::end(&mix));
        let service = Service::open(&database.url(), &clock).await;
        service.provide(&clock).await;
        let mut dice = Dice::new(seed, &["schedule"]);
        let (mut orders, mut waiting, mut tails) = (Vec::new(), Vec::new(), BTreeSet::new());
        let mask = &Bundle::all()[0].model.bundle().masks()[0];
        for operator in 0..mix.operators {
            let told = Teller::new(seed, &mix, operator, mask).tell();
            waiting.push(late(orders.len(), told.len(), mix.lateness, &mut dice));
            tails.extend(told.iter().filter_map(|input| match input {
                Input::Upload(upload) => Some((operator, upload.tail.clone())),
                _ => None,
            }));
            orders.extend(told);
        }
        let keys = Keyring::new(seed, mix.operators, &tails.into_iter().collect::<Vec<_>>());
        keys.hand_over(&service, clock.now()).await;
        let hands = (0..mix.workers).map(|_| Hands::new(&service, &clock)).collect();
        let ledger = Ledger::new(mix.operators);
        Self {
            dice,
            clock,
            database,
            service,
            hands,
            keys,
            ledger,
            orders,
            waiting,
            network: Vec::new(),
            tally: Tally::new(),
            mix,
        }
    }

    fn count(&mut self, what: &'static str) {
        *self.tally.entry(what).or_default() += 1;
    }

    /// Lets everything be sent and acknowledged, whatever goes wrong.
    async fn go_on(&mut self) {
        for _ in 0..MOST_STEPS {
            let left: usize = self.waiting.iter().map(VecDeque::len).sum();
            if left == 0 && self.network.is_empty() {
                return;
            }
            let window = self.mix.window * self.mix.operators;
            let send = if left > 0 && self.network.len() < window { 1.0 } else { 0.0 };
            let deliver = if self.network.is_empty() { 0.0 } else { 1.0 };
            let step = self.dice.weighted(&[
                (send, Step::Send),
                (deliver, Step::Deliver),
                (self.mix.diligence, Step::Work),
                (0.3, Step::Ask),
                (self.mix.restarts, Step::Restart),
                (self.mix.leaps, Step::Leap),
                (self.mix.rests, Step::Rest),
                (self.mix.activations, Step::Activate),
                (self.mix.rotations, Step::Rotate),
            ]);
            self.clock.pass(self.dice.number(0.0..2.0));
            self.take(step).await;
        }
        panic!("not everything was acknowledged after {MOST_STEPS} steps: {:?}", self.network);
    }

    async fn take(&mut self, step: Step) {
        match step {
            Step::Send => self.send(),
            Step::Deliver => self.deliver().await,
            Step::Work => self.work().await,
            Step::Ask => self.ask().await,
            Step::Restart => self.restart().await,
            Step::Leap => {
                self.count("leaps");
                self.clock.pass(86_400.0 * self.dice.number(0.1..20.0));
            }
            Step::Rest => {
                self.count("rests");
                self.settle().await;
            }
            Step::Rotate => self.rotate().await,
            Step::Activate => {
                let bundle = self.dice.whole(0..Bundle::all().len());
                let all_lives = self.dice.chance(self.mix.all_lives);
                self.count(if all_lives { "activations for all lives" } else { "activations" });
                self.service.activate(bundle, all_lives, &self.clock).await;
                self.ledger.activated(bundle, all_lives);
            }
        }
    }

    /// An operator's client sends the next of what it has to, some of it together.
    fn send(&mut self) {
        let able: Vec<usize> = (0..self.waiting.len()).filter(|operator| !self.waiting[*operator].is_empty()).collect();
        let operator = *self.dice.pick(&able);
        let first = self.waiting[operator].pop_front().expect("it is able");
        let way = Way::draw(&self.orders[first], &mut self.dice);
        let mut orders = vec![first];
        while let Some(&next) = self.waiting[operator].front()
            && way.carries(&self.orders[first], &self.orders[next])
            && self.dice.chance(0.7)
        {
            orders.extend(self.waiting[operator].pop_front());
        }
        let inputs: Vec<&Input> = orders.iter().map(|&order| &self.orders[order]).collect();
        let key = self.keys.for_inputs(operator, &inputs, &mut self.dice);
        self.network.push(Packet { operator, orders, way, key, awaited: true });
    }

    /// One of the requests under way arrives, or does not.
    async fn deliver(&mut self) {
        let packet = self.network.swap_remove(self.dice.whole(0..self.network.len()));
        if self.dice.chance(self.mix.lost_requests) {
            self.count("lost requests");
            return self.send_again(packet);
        }
        if self.dice.chance(self.mix.duplicates) {
            self.count("duplicated requests");
            self.network.push(Packet { awaited: false, ..packet.clone() });
        }
        if packet.way == Way::Rest && self.dice.chance(self.mix.hang_ups) {
            self.hang_up(&packet).await;
            return self.send_again(packet);
        }
        let inputs: Vec<Input> = packet.orders.iter().map(|&order| self.orders[order].clone()).collect();
        let key = self.keys.key(packet.key);
        let references: Vec<&Input> = inputs.iter().collect();
        let statuses = deliver(&self.service, (packet.operator, key), &references, packet.way).await;
        assert_eq!(statuses.len(), inputs.len(), "one answer to each input");
        let (may_be_refused, must_be_refused) = key.is_refused(self.clock.now());
        let refused = statuses.iter().all(|status| *status == 401);
        assert!(refused || !must_be_refused, "a revoked token opens: {statuses:?}");
        if refused && may_be_refused {
            self.count("refused tokens");
            return self.send_again(packet);
        }
        for (input, status) in inputs.iter().zip(statuses) {
            self.ledger.answered(packet.operator, input, status, self.clock.now());
            self.count(match status {
                200 => "done before",
                201 | 202 => "done",
                404 => "unknown",
                409 => "conflicts",
                _ => "other answers",
            });
        }
        if self.dice.chance(self.mix.lost_answers) {
            self.count("lost answers");
            self.send_again(packet);
        }
    }

    /// A client that has no answer sends the same again.
    fn send_again(&mut self, packet: Packet) {
        if packet.awaited {
            packet.orders.iter().rev().for_each(|&order| self.waiting[packet.operator].push_front(order));
        }
    }

    /// A client goes away while it is answered. Whether its input counts is the service's to say, and to stand by.
    async fn hang_up(&mut self, packet: &Packet) {
        let operator: OperatorId = operators::name(packet.operator).parse().expect("a name");
        let input = self.orders[packet.orders[0]].clone();
        let turns = self.dice.whole(1..40);
        let status = match &input {
            Input::Upload(upload) => {
                self.service.hang_up(self.keys.key(packet.key).signed(input.request()), turns).await;
                let found = self.service.store().upload(&operator, &upload.upload_id).await.expect("a read");
                found.is_some_and(|record| record.upload == *upload).then_some(202)
            }
            Input::Event { body, .. } => {
                self.service.hang_up(self.keys.key(packet.key).signed(input.request()), turns).await;
                let id = body.event_id.parse().expect("a name");
                let found = self.service.store().event(&operator, &id).await.expect("a read");
                let is_it = |event: &domain::MaintenanceEvent| event.flight_hours == body.flight_hours;
                found.is_some_and(|record| is_it(&record.event)).then_some(201)
            }
            _ => return,
        };
        self.count("hang-ups");
        if let Some(new) = status
            && self.ledger.expected(packet.operator, &input).contains(&new)
        {
            self.ledger.answered(packet.operator, &input, new, self.clock.now());
        }
    }

    /// A worker takes its next step, or dies, or sleeps through its lease before.
    async fn work(&mut self) {
        let worker = self.dice.whole(0..self.hands.len());
        if let Some(lease) = self.hands[worker].lease() {
            let slept = Lease::duration(LEASE, lease.attempts).as_secs_f64() + 1.0;
            if self.dice.chance(self.mix.killed_workers) {
                self.count("killed workers");
                self.hands[worker] = Hands::new(&self.service, &self.clock);
                return;
            }
            if self.dice.chance(self.mix.sleeping_workers) {
                self.count("sleeping workers");
                self.clock.pass(slept);
                return;
            }
        }
        self.step_of(worker).await;
    }

    /// A worker takes its next step; tells whether there was one.
    async fn step_of(&mut self, worker: usize) -> bool {
        let stepped = self.hands[worker].step(&self.service).await;
        match stepped {
            Stepped::Idle => return false,
            Stepped::Leased(lease) => {
                self.count("leases");
                self.ledger.leased(&lease, self.clock.now());
            }
            Stepped::Analysed => self.count("analyses"),
            Stepped::Completed(lease, completion) => {
                self.count(match completion {
                    store::Completion::Done => "results written",
                    store::Completion::Fenced => "results refused",
                });
                self.ledger.completed(&lease, completion, self.clock.now());
            }
        }
        true
    }

    /// Somebody asks something; an answer that contradicts what was acknowledged is a failure.
    async fn ask(&mut self) {
        self.count("questions");
        let operator = self.dice.whole(0..self.mix.operators);
        let about = self.dice.whole(0..self.mix.operators);
        let questions = Question::all(&self.ledger.books[about]);
        let question = self.dice.pick(&questions).clone();
        let key = self.keys.for_questions(operator, &mut self.dice);
        let answer = self.service.answer(self.keys.key(key).signed(get(&question.path()))).await;
        let judged = match about == operator {
            true => question.judge(&answer, &self.ledger, operator),
            false => keeps_within(&answer, operator, &question.path()),
        };
        judged.unwrap_or_else(|wrong| panic!("{} asks {}: {wrong}", operators::name(operator), question.path()));
    }

    /// Somebody's key is replaced who is using it, and goes on to show the old one for a while.
    async fn rotate(&mut self) {
        let old = self.keys.spare(&mut self.dice);
        self.show(old).await;
        let what = self.keys.replace(old, &self.service, self.clock.now()).await;
        self.count(what);
        self.clock.pass(self.dice.number(0.0..2.0));
        self.show(old).await;
    }

    /// The owner of a key asks what everyone may ask.
    async fn show(&mut self, key: usize) {
        let key = self.keys.key(key);
        let answer = self.service.answer(key.signed(get(&Question::Models.path()))).await;
        let refused = answer.status == 401;
        let (may_be_refused, must_be_refused) = key.is_refused(self.clock.now());
        assert!(if refused { may_be_refused } else { !must_be_refused }, "{key:?} is answered {answer:?}");
        if refused {
            self.count("refused tokens");
        }
    }

    /// The service ends, in order or not, and comes back; those who worked in its process end with it.
    async fn restart(&mut self) {
        let url = self.database.url();
        let killed = self.dice.chance(0.5);
        self.count(if killed { "kills" } else { "restarts" });
        self.hands.clear();
        match killed {
            true => self.service.die_and_come_back(&url, &self.clock).await,
            false => self.service.restart(&url, &self.clock).await,
        }
        self.hands = (0..self.mix.workers).map(|_| Hands::new(&self.service, &self.clock)).collect();
        if self.database.has_one_owner() {
            self.ledger.restarted();
        }
    }

    /// Workers come to the end of what waits, also of what is leased to the dead or backs off; then no upload waits.
    async fn settle(&mut self) {
        let mut idle_rounds = 0;
        for _ in 0..MOST_STEPS {
            let mut busy = false;
            for worker in 0..self.hands.len() {
                busy |= self.step_of(worker).await;
            }
            idle_rounds = if busy { 0 } else { idle_rounds + 1 };
            if idle_rounds == 2 {
                let figures = self.service.store().work_figures().await.expect("a read");
                assert_eq!(figures.pending, 0, "workers are idle, but uploads wait");
                return;
            } else if !busy {
                self.clock.pass(PATIENCE_S);
            }
        }
        panic!("workers come to no end");
    }

    /// Everything is as the ledger says, and as if it had come in order.
    async fn conclude(mut self) -> Outcome {
        for operator in 0..self.mix.operators {
            self.nothing_is_lost(operator).await;
        }
        for chain in self.service.store().verify_audit().await.expect("a read") {
            assert!(chain.damage.is_none(), "{chain:?}");
        }
        let digest = self.service.store().digest().await.expect("a digest");
        self.tally.insert("uploads", self.ledger.books.iter().map(|book| book.uploads.len() as u64).sum());
        self.tally.insert("events", self.ledger.books.iter().map(|book| book.events.len() as u64).sum());
        self.tally.insert("states", digest.states);
        self.tally.insert("estimates", digest.estimates);
        reference::compare(&self.service, &self.ledger, &self.keys, &self.clock).await;
        self.hands.clear();
        self.service.stop().await;
        Outcome { tally: self.tally, digest: digest.digest.to_string() }
    }

    /// Every acknowledged upload is there exactly once, and every answer is as it must be.
    async fn nothing_is_lost(&self, operator: usize) {
        let book = &self.ledger.books[operator];
        let mut listed = Vec::new();
        for question in Question::all(book) {
            let asked = self.keys.admin(operator).signed(get(&question.path()));
            let answer = self.service.answer(asked).await;
            let judged = question.judge(&answer, &self.ledger, operator);
            judged.unwrap_or_else(|wrong| panic!("{} asks {}: {wrong}", operators::name(operator), question.path()));
            if let Question::Uploads(_) = question {
                let page: serde_json::Value = serde_json::from_slice(&answer.body).expect("a page");
                let items = page["items"].as_array().expect("items").iter();
                listed.extend(items.map(|item| item["upload_id"].as_str().expect("a name").to_owned()));
            }
        }
        listed.sort();
        let known: Vec<String> = book.uploads.keys().map(|id| id.to_string()).collect();
        assert_eq!(listed, known, "uploads of {}", operators::name(operator));
    }
}

/// Numbers from `first` on, in the order in which they are sent: each is as late as its draw says.
fn late(first: usize, count: usize, lateness: f64, dice: &mut Dice) -> VecDeque<usize> {
    let mut due: Vec<(f64, usize)> =
        (0..count).map(|i| (i as f64 + lateness * dice.exponential(), first + i)).collect();
    due.sort_by(|a, b| a.0.total_cmp(&b.0));
    due.into_iter().map(|(_, order)| order).collect()
}
