//! `actuary watch`: the fleet as a live board in the terminal. It asks whether something changed, and redraws only then.

mod keys;
mod screen;

use std::{
    io::{self, IsTerminal},
    time::Duration,
};

use anyhow::{Context, Result};
use clap::Args;
use tokio::time::{self, MissedTickBehavior};

use self::{
    keys::{Key, keys},
    screen::Screen,
};
use super::{
    fleet::{fleet, told},
    until::Until,
};
use crate::{
    client::{self, Endpoint, Question, Service, Tagged, joined},
    exit::Failure,
    interrupt, say,
    table::board::Board,
};

/// Watch the fleet: the most urgent units, drawn anew when something changed. Where standard output is no terminal, the table of
/// now.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  actuary watch --check C-check --every 10\n\n\
    Keys: arrows, Page Up and Page Down move through the list; q or Ctrl-C ends it and leaves the terminal as it was.")]
pub struct Arguments {
    #[command(flatten)]
    until: Until,
    /// Ask every so many seconds whether something changed, 1 to 3600.
    #[arg(long, value_name = "S", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=3600))]
    every: u64,
    #[command(flatten, next_help_heading = "Service")]
    endpoint: Endpoint,
}

/// Shows the board until a key or a signal ends it.
pub fn run(arguments: &Arguments) -> Result<()> {
    let question = arguments.until.of(fleet());
    if io::stdout().is_terminal() {
        return client::wait(watch(arguments, &question));
    }
    let answer = client::wait(async { arguments.endpoint.service()?.whole(&question, &["items"]).await })?;
    say::text(told(&answer, false)?);
    Ok(())
}

async fn watch(arguments: &Arguments, question: &Question) -> Result<()> {
    let service = arguments.endpoint.service()?;
    // Before the terminal is taken: what is wrong with the question or the address is told as by any command.
    let mut pages = service.pages(question, &[]).await?;
    let mut screen = Screen::take(board(&pages)?)?;
    let (mut keys, interrupted) = (keys(), interrupt::interrupted());
    tokio::pin!(interrupted);
    let mut ticks = time::interval(Duration::from_secs(arguments.every));
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            () = &mut interrupted => return Err(Failure::Interrupted("the board is closed".to_owned()).into()),
            Some(key) = keys.recv() => match key {
                Key::End => return Ok(()),
                Key::Resized => screen.draw()?,
                Key::Moved(lines) => screen.moved(lines)?,
            },
            _ = ticks.tick() => refresh(&service, question, &mut pages, &mut screen).await?,
        }
    }
}

/// Draws the board anew if something changed; one that nobody tells of any longer says so.
async fn refresh(service: &Service, question: &Question, pages: &mut Vec<Tagged>, screen: &mut Screen) -> Result<()> {
    match service.pages(question, pages).await {
        Ok(fresh) if fresh == *pages => screen.answered()?,
        Ok(fresh) => {
            screen.changed(board(&fresh)?)?;
            *pages = fresh;
        }
        Err(error) => screen.unanswered(format!("{error:#}"))?,
    }
    Ok(())
}

fn board(pages: &[Tagged]) -> Result<Board> {
    let whole = joined(pages.iter().map(|tagged| tagged.page.clone()), &["items"]);
    Board::read(&whole).context("the service answers oddly")
}
