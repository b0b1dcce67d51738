//! What a signal ends: a service in order, anything else at once, and nothing unfinished stays on disk.
//!
//! The first SIGINT, SIGTERM or SIGHUP goes to whoever waits for it ([`interrupted`]). Where nobody does, and from the second on,
//! the process ends at once: what is unfinished is removed, and the exit code is that of a process which the signal killed.

use std::{
    fs,
    io::{self, ErrorKind},
    path::{Path, PathBuf},
    process,
    sync::{
        LazyLock, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread,
    time::Duration,
};

use tokio::{
    runtime,
    signal::unix::{Signal, SignalKind, signal},
    sync::{mpsc, watch},
};

use crate::say::note;

/// What is being made on disk.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
/// How many wait for a signal.
static WAITING: AtomicUsize = AtomicUsize::new(0);
/// The signal that they were told of.
static TOLD: LazyLock<watch::Sender<Option<i32>>> = LazyLock::new(|| watch::Sender::new(None));
/// Whether a hangup is a message and no end.
static HANGUPS_ARE_TAKEN: AtomicBool = AtomicBool::new(false);

/// How often and after which pauses a folder is removed in which somebody still writes.
const REMOVALS: u32 = 100;
const PAUSE: Duration = Duration::from_millis(5);

/// Takes the signals of this process from now on.
pub fn watch() -> io::Result<()> {
    let runtime = runtime::Builder::new_current_thread().enable_io().build()?;
    let watched = {
        let _inside = runtime.enter();
        // Whoever started the process with nohup wants no hangup to end it.
        let ends = |kind: &SignalKind| *kind != SignalKind::hangup() || !hangup_is_ignored();
        let kinds = [SignalKind::interrupt(), SignalKind::terminate(), SignalKind::hangup()];
        let listen = |kind: SignalKind| signal(kind).map(|signal| (kind.as_raw_value(), signal));
        kinds.into_iter().filter(ends).map(listen).collect::<io::Result<Vec<_>>>()?
    };
    thread::Builder::new().name("signals".to_owned()).spawn(move || runtime.block_on(pass_on(watched)))?;
    Ok(())
}

async fn pass_on(signals: Vec<(i32, Signal)>) {
    let (sender, mut numbers) = mpsc::channel(1);
    for (number, mut signal) in signals {
        let sender = sender.clone();
        tokio::spawn(async move { while signal.recv().await.is_some() && sender.send(number).await.is_ok() {} });
    }
    while let Some(number) = numbers.recv().await {
        if number == SignalKind::hangup().as_raw_value() && HANGUPS_ARE_TAKEN.load(Ordering::SeqCst) {
            continue;
        }
        if TOLD.borrow().is_some() || WAITING.load(Ordering::SeqCst) == 0 {
            end(number);
        }
        TOLD.send_replace(Some(number));
    }
}

/// Whether the process was started so that a hangup does nothing to it.
fn hangup_is_ignored() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask & 1 << (SignalKind::hangup().as_raw_value() - 1) != 0
}

/// Ends the process; the lock is never given back, so that nobody else says or finishes anything.
fn end(number: i32) -> ! {
    let unfinished = unfinished();
    unfinished.iter().for_each(|path| remove(path));
    note!("actuary: interrupted");
    process::exit(128 + number)
}

fn remove(path: &Path) {
    for _ in 0..REMOVALS {
        let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
        match removed {
            Ok(()) => return,
            Err(error) if error.kind() == ErrorKind::NotFound => return,
            Err(_) => thread::sleep(PAUSE),
        }
    }
}

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Waits for the end if a signal is ending the process at this moment.
pub fn not_ending() {
    drop(unfinished());
}

/// The exit code of a process that a signal told to end.
pub fn exit_code() -> u8 {
    let number = TOLD.borrow().unwrap_or(SignalKind::interrupt().as_raw_value());
    128 + u8::try_from(number).unwrap_or(0)
}

/// Ends when the process is told to end, or has been told before. From the call on, a signal is no end by itself.
pub fn interrupted() -> impl Future<Output = ()> {
    struct Waiting;

    impl Drop for Waiting {
        fn drop(&mut self) {
            WAITING.fetch_sub(1, Ordering::SeqCst);
        }
    }

    WAITING.fetch_add(1, Ordering::SeqCst);
    let waiting = Waiting;
    let mut told = TOLD.subscribe();
    async move {
        let _waiting = waiting;
        let _ = told.wait_for(Option::is_some).await;
    }
}

/// Hangups, which end nothing from now on.
pub fn hangups() -> io::Result<Signal> {
    let hangups = signal(SignalKind::hangup())?;
    HANGUPS_ARE_TAKEN.store(true, Ordering::SeqCst);
    Ok(hangups)
}

/// A temporary file or folder that goes with its owner, and with the process if a signal ends that.
#[derive(Debug)]
pub struct Unfinished<T: AsRef<Path>> {
    /// Until it is finished.
    made: Option<T>,
    path: PathBuf,
}

impl<T: AsRef<Path>> Unfinished<T> {
    /// Makes it; no signal comes between the making and the noting.
    pub fn new(make: impl FnOnce() -> io::Result<T>) -> io::Result<Self> {
        let mut unfinished = unfinished();
        let made = make()?;
        let path = made.as_ref().to_owned();
        unfinished.push(path.clone());
        Ok(Self { made: Some(made), path })
    }

    /// It, as it is so far.
    pub fn made(&self) -> &T {
        self.made.as_ref().expect("there until it is finished")
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives it its place; a signal waits for `finish`.
    pub fn finish<R>(mut self, finish: impl FnOnce(T) -> R) -> R {
        let _signals_wait = unfinished();
        finish(self.made.take().expect("there until it is finished"))
    }
}

impl<T: AsRef<Path>> Drop for Unfinished<T> {
    fn drop(&mut self) {
        let mut unfinished = unfinished();
        drop(self.made.take());
        unfinished.retain(|path| *path != self.path);
    }
}
