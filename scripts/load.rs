//! A load generator for `scripts/bench`: HTTP/1.1 on connections that stay open, one request after the other on each.
//!
//! `load ADDRESS CONNECTIONS SECONDS PATH [HEADER]...` asks for one path as often as it can;
//! `load ADDRESS CONNECTIONS FILE [RATE]` sends each line of a file, a path and a body with a tab between, once, no
//! faster than so many a second;
//! `load ADDRESS CONNECTIONS SECONDS @FILE PAUSE` polls as dashboards do: each connection walks through the lines of a
//! file, a name and a path with a tab between, with so many ms after each answer; every other shows the tags it saw.
//! It says the rate, the median and 99th percentile of the time in ms, and the answers by status; of dashboards a line
//! per name, and the seconds of CPU that it took itself. Nothing but the standard library: `rustc -O scripts/load.rs`.

use std::{
    collections::{BTreeMap, HashMap},
    env, fs,
    io::{self, BufRead, BufReader, Write},
    net::TcpStream,
    sync::atomic::{AtomicUsize, Ordering},
    thread,
    time::{Duration, Instant},
};

/// What one connection saw: status and time of each answer.
type Seen = Vec<(u16, Duration)>;

fn main() -> io::Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let (address, connections) = (&arguments[0], arguments[1].parse().expect("a number of connections"));
    let start = Instant::now();
    let seen = match arguments[2].parse::<f64>() {
        Ok(seconds) if arguments[3].starts_with('@') => {
            let asked = fs::read_to_string(&arguments[3][1..])?;
            let parted = |line| str::split_once(line, '\t').expect("a name, a tab and a path");
            let asked: Vec<_> = asked.lines().map(parted).collect();
            let pause = Duration::from_millis(arguments[4].parse().expect("a pause in ms"));
            return dashboards(address, connections, start + Duration::from_secs_f64(seconds), &asked, pause);
        }
        Ok(seconds) => {
            let headers: String = arguments[4..].iter().map(|header| format!("{header}\r\n")).collect();
            let request = format!("GET {} HTTP/1.1\r\nHost: {address}\r\n{headers}\r\n", arguments[3]);
            let until = start + Duration::from_secs_f64(seconds);
            on_each(address, connections, &|| (Instant::now() < until).then(|| request.clone().into_bytes()))?
        }
        Err(_) => {
            let text = fs::read_to_string(&arguments[2])?;
            let requests: Vec<Vec<u8>> = text.lines().map(|line| post(address, line)).collect();
            let next = AtomicUsize::new(0);
            let between = arguments.get(3).map_or(0.0, |rate| 1.0 / rate.parse::<f64>().expect("a rate"));
            on_each(address, connections, &|| {
                let number = next.fetch_add(1, Ordering::Relaxed);
                let due = start + Duration::from_secs_f64(between * number as f64);
                thread::sleep(due.saturating_duration_since(Instant::now()));
                requests.get(number).cloned()
            })?
        }
    };
    println!("{}", told(seen, start.elapsed()));
    Ok(())
}

/// Polls until a time, and tells what it saw, a line per name.
fn dashboards(
    address: &str,
    connections: usize,
    until: Instant,
    asked: &[(&str, &str)],
    pause: Duration,
) -> io::Result<()> {
    let start = Instant::now();
    let mut seen = BTreeMap::<&str, Seen>::new();
    thread::scope(|scope| {
        let first = |client: usize| client * asked.len() / connections;
        let one = |client| scope.spawn(move || dashboard(address, until, asked, pause, first(client), client % 2 == 1));
        for thread in (0..connections).map(one).collect::<Vec<_>>() {
            for (name, status, time) in thread.join().expect("a connection ended abnormally")? {
                seen.entry(name).or_default().push((status, time));
            }
        }
        io::Result::Ok(())
    })?;
    seen.into_iter().for_each(|(name, seen)| println!("{name}\t{}", told(seen, start.elapsed())));
    println!("load generator\t{:.1}", cpu_s()?);
    Ok(())
}

fn dashboard<'a>(
    address: &str,
    until: Instant,
    asked: &[(&'a str, &str)],
    pause: Duration,
    first: usize,
    shows_tags: bool,
) -> io::Result<Vec<(&'a str, u16, Duration)>> {
    let mut stream = TcpStream::connect(address)?;
    stream.set_nodelay(true)?;
    let mut reader = BufReader::new(stream.try_clone()?);
    let (mut seen, mut body, mut tags) = (Vec::new(), Vec::new(), HashMap::new());
    for (name, path) in asked.iter().cycle().skip(first) {
        if Instant::now() >= until {
            break;
        }
        let shown = tags.get(path).map_or(String::new(), |tag| format!("If-None-Match: {tag}\r\n"));
        let start = Instant::now();
        stream.write_all(format!("GET {path} HTTP/1.1\r\nHost: {address}\r\n{shown}\r\n").as_bytes())?;
        let (status, tag) = answer(&mut reader, &mut body)?;
        seen.push((*name, status, start.elapsed()));
        if let Some(tag) = tag.filter(|_| shows_tags) {
            tags.insert(*path, tag);
        }
        thread::sleep(pause);
    }
    Ok(seen)
}

/// Seconds of CPU of this process so far, at 100 ticks each.
fn cpu_s() -> io::Result<f64> {
    let stat = fs::read_to_string("/proc/self/stat")?;
    let ticks = |field: usize| stat.split(' ').nth(field).and_then(|word| word.parse::<f64>().ok()).unwrap_or(0.0);
    Ok((ticks(13) + ticks(14)) / 100.0)
}

fn post(address: &str, line: &str) -> Vec<u8> {
    let (path, body) = line.split_once('\t').expect("a path, a tab and a body");
    let length = body.len();
    let head = "HTTP/1.1\r\nContent-Type: application/json\r\n";
    format!("POST {path} {head}Host: {address}\r\nContent-Length: {length}\r\n\r\n{body}").into_bytes()
}

/// Sends what `next` gives on each of some connections, until it gives nothing.
fn on_each(address: &str, connections: usize, next: &(dyn Fn() -> Option<Vec<u8>> + Sync)) -> io::Result<Seen> {
    thread::scope(|scope| {
        let threads: Vec<_> = (0..connections).map(|_| scope.spawn(|| exchange(address, next))).collect();
        let mut all = Vec::new();
        for thread in threads {
            all.extend(thread.join().expect("a connection ended abnormally")?);
        }
        Ok(all)
    })
}

fn exchange(address: &str, next: &(dyn Fn() -> Option<Vec<u8>> + Sync)) -> io::Result<Seen> {
    let mut stream = TcpStream::connect(address)?;
    stream.set_nodelay(true)?;
    let mut reader = BufReader::new(stream.try_clone()?);
    let (mut seen, mut body) = (Vec::new(), Vec::new());
    while let Some(request) = next() {
        let start = Instant::now();
        stream.write_all(&request)?;
        let (status, _) = answer(&mut reader, &mut body)?;
        seen.push((status, start.elapsed()));
    }
    Ok(seen)
}

/// Reads an answer, for its status and its tag; those without a length have no body.
fn answer(reader: &mut impl BufRead, body: &mut Vec<u8>) -> io::Result<(u16, Option<String>)> {
    let (mut line, mut status, mut length, mut tag) = (String::new(), 0, 0, None);
    loop {
        line.clear();
        reader.read_line(&mut line)?;
        match line.trim_end() {
            "" => break,
            head if status == 0 => {
                status = head.split(' ').nth(1).and_then(|word| word.parse().ok()).ok_or(io::ErrorKind::InvalidData)?;
            }
            header => {
                let (name, value) = header.split_once(':').ok_or(io::ErrorKind::InvalidData)?;
                if name.eq_ignore_ascii_case("content-length") {
                    length = value.trim().parse().map_err(|_| io::ErrorKind::InvalidData)?;
                } else if name.eq_ignore_ascii_case("etag") {
                    tag = Some(value.trim().to_owned());
                }
            }
        }
    }
    body.resize(if status == 304 { 0 } else { length }, 0);
    reader.read_exact(body)?;
    Ok((status, tag))
}

fn told(mut seen: Seen, elapsed: Duration) -> String {
    let mut by_status = BTreeMap::new();
    seen.iter().for_each(|(status, _)| *by_status.entry(*status).or_insert(0) += 1);
    seen.sort_by_key(|(_, time)| *time);
    let at = |share: f64| 1e3 * seen[((share * seen.len() as f64) as usize).min(seen.len() - 1)].1.as_secs_f64();
    let rate = seen.len() as f64 / elapsed.as_secs_f64();
    let statuses: Vec<String> = by_status.iter().map(|(status, count)| format!("{status}:{count}")).collect();
    format!("{rate:.0} {:.3} {:.3} {}", at(0.5), at(0.99), statuses.join(","))
}
