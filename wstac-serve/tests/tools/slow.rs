//! Clients that are slower than the sensor, over a real socket.

use std::io::{ErrorKind, Read, Write};
use std::thread::{self, sleep};
use std::time::{Duration, Instant};

use serde_json::Value;
use tungstenite::{Error, Message};
use wstac_host::config::Config;
use wstac_serve::{Server, Tools};

use super::page::{Page, Served};

/// Time in which everything that is on its way arrives.
const SETTLED: Duration = Duration::from_millis(700);

/// A client that acknowledges when it wants to.
struct Client {
    page: Page,
    updates: u64,
    first: Option<u64>,
    /// The frame and the count of the last update.
    last: u64,
    skipped: u64,
}

impl Client {
    fn new(served: &Served) -> Self {
        let page = served.page();
        page.socket.get_ref().set_read_timeout(Some(SETTLED)).unwrap();
        Self { page, updates: 0, first: None, last: 0, skipped: 0 }
    }

    /// Takes an update; `false` if none arrives.
    fn take(&mut self) -> bool {
        loop {
            let text = match self.page.socket.read() {
                Ok(Message::Text(text)) => text,
                Ok(_) => continue,
                Err(Error::Io(error)) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                    return false;
                }
                Err(error) => panic!("{error}"),
            };
            let message: Value = serde_json::from_str(&text).unwrap();
            // A sign of life is no update.
            let Some(frame) = message["status"]["frame"].as_u64() else { continue };
            (self.last, self.skipped) = (frame, message["skipped"].as_u64().unwrap());
            self.first.get_or_insert(frame);
            self.updates += 1;
            return true;
        }
    }

    fn acknowledge(&mut self) {
        self.page.say("ok");
    }

    /// Checks that each frame since the first update was shown or counted.
    fn counts_all(&self) {
        assert_eq!(self.first.unwrap() + self.updates - 1 + self.skipped, self.last);
    }
}

/// Gives frames, so many per second.
fn play(served: &Served, frames: u64, per_second: u64) {
    for frame in 1..=frames {
        served.allow(frame);
        sleep(Duration::from_secs(1) / per_second as u32);
    }
}

/// One client acknowledges nothing, and the other everything: each gets what it can take, and the count of the rest.
#[test]
fn a_slow_client_skips_frames_and_holds_up_nobody() {
    let served = Served::new(None, &Config::default(), Tools::default());
    let (mut slow, mut fast) = (Client::new(&served), Client::new(&served));
    let fast = thread::scope(|scope| {
        let fast = scope.spawn(move || {
            while fast.last < 60 && fast.take() {
                fast.acknowledge();
            }
            fast
        });
        play(&served, 60, 30);
        fast.join().unwrap()
    });
    fast.counts_all();
    assert_eq!(fast.last, 60, "it sees the newest frame");
    while slow.take() {}
    assert_eq!(slow.updates, 2, "two rounds are sent before the first is acknowledged");
    assert!(slow.last < 30 && fast.updates > 10 && fast.skipped < 50, "{} {}", slow.last, fast.updates);
    slow.acknowledge();
    slow.acknowledge();
    while slow.take() {}
    assert_eq!((slow.updates, slow.last), (3, 60), "then it sees the newest frame");
    assert!(slow.skipped > 30, "{}", slow.skipped);
    slow.counts_all();
    assert_eq!(served.end().0, 0);
}

/// A sensor of 200 frames per second makes 30 updates per second.
#[test]
fn a_client_gets_thirty_updates_per_second() {
    let served = Served::new(None, &Config::default(), Tools::default());
    let mut client = Client::new(&served);
    let client = thread::scope(|scope| {
        let client = scope.spawn(move || {
            while client.last < 120 && client.take() {
                client.acknowledge();
            }
            client
        });
        // On a machine that is busy, it takes longer than 0.6 s.
        let start = Instant::now();
        play(&served, 120, 200);
        let client = client.join().unwrap();
        let most = start.elapsed().as_secs_f64() * 30.0 + 3.0;
        assert!(client.updates as f64 <= most, "{} updates, expected at most {most}", client.updates);
        client
    });
    assert_eq!(client.last, 120);
    client.counts_all();
    assert_eq!(served.end().0, 0);
}

/// Half a request has its answer after 5 s, and a page that acknowledges nothing is gone when patience ends.
#[test]
fn whoever_does_not_go_on_goes() {
    let server = Server::bind("127.0.0.1:0".parse().unwrap(), None).unwrap();
    let server = server.with_patience(Duration::from_secs(7));
    let served = Served::of(None, &Config::default(), Tools::default(), server);
    let (start, mut half, mut page) = (Instant::now(), served.connect(), served.page());
    served.allow(5);
    half.write_all(b"GET / HTTP/1.1\r\n").unwrap();
    let mut answer = String::new();
    half.read_to_string(&mut answer).unwrap();
    // A busy machine may take longer. What never goes ends the patience of this side.
    let seconds = start.elapsed().as_secs();
    assert!(answer.starts_with("HTTP/1.1 408 ") && seconds >= 4, "{answer} after {seconds} s");
    let gone = loop {
        match page.socket.read() {
            Ok(_) => {}
            Err(error) => break error,
        }
    };
    let seconds = start.elapsed().as_secs();
    let is_patience =
        matches!(&gone, Error::Io(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut));
    assert!(!is_patience && seconds >= 6, "after {seconds} s: {gone}");
    assert_eq!(served.end().0, 0);
}
