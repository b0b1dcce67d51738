//! A load generator for `scripts/bench`: HTTP/1.1 on connections that stay open, one request after the other on each.
//!
//! `load ADDRESS CONNECTIONS SECONDS PATH [HEADER]...` asks for one path as often as it can;
//! `load ADDRESS CONNECTIONS FILE` sends each line of a file, a path and a body with a tab between, once.
//! It says the rate, the median and 99th percentile of the time in ms, and the answers by status. Nothing but the
//! standard library: `rustc -O scripts/load.rs`.

use std::{
    collections::BTreeMap,
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
            on_each(address, connections, &|| requests.get(next.fetch_add(1, Ordering::Relaxed)).cloned())?
        }
    };
    report(seen, start.elapsed());
    Ok(())
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
        let status = answer(&mut reader, &mut body)?;
        seen.push((status, start.elapsed()));
    }
    Ok(seen)
}

/// Reads an answer; those without a length have no body.
fn answer(reader: &mut impl BufRead, body: &mut Vec<u8>) -> io::Result<u16> {
    let (mut line, mut status, mut length) = (String::new(), 0, 0);
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
                }
            }
        }
    }
    body.resize(length, 0);
    reader.read_exact(body)?;
    Ok(status)
}

fn report(mut seen: Seen, elapsed: Duration) {
    let mut by_status = BTreeMap::new();
    seen.iter().for_each(|(status, _)| *by_status.entry(*status).or_insert(0) += 1);
    seen.sort_by_key(|(_, time)| *time);
    let at = |share: f64| 1e3 * seen[((share * seen.len() as f64) as usize).min(seen.len() - 1)].1.as_secs_f64();
    let rate = seen.len() as f64 / elapsed.as_secs_f64();
    let statuses: Vec<String> = by_status.iter().map(|(status, count)| format!("{status}:{count}")).collect();
    println!("{rate:.0} {:.3} {:.3} {}", at(0.5), at(0.99), statuses.join(","));
}
