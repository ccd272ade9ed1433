//! The refusals of the server, and their reasons.

use std::io::{Read, Write};
use std::time::Duration;

use serde_json::json;
use tempfile::tempdir;
use tungstenite::Message;
use tungstenite::protocol::frame::coding::CloseCode;
use wstac_host::config::Config;
use wstac_serve::{Server, Token, Tools};

use super::page::Served;

#[test]
fn only_the_page_itself_can_give_orders() {
    let served = Served::new(None, &Config::default(), Tools::default());
    for headers in ["Origin: http://example.org\r\n", "Origin: null\r\n", "Host: example.org\r\n"] {
        assert_eq!(served.request(headers).map(drop), Err("403".to_owned()), "{headers}");
    }
    assert!(served.request("").is_ok(), "a program on this machine has no origin");
}

#[test]
fn orders_need_the_token_if_there_is_one() {
    let token = Token::new("0123456789abcdef", "the token").unwrap();
    let served = Served::with_token(None, &Config::default(), Tools::default(), Some(token));
    for query in ["", "?token=", "?token=0123456789abcdeX"] {
        assert_eq!(served.request_with(query, "").map(drop), Err("403".to_owned()), "{query}");
    }
    assert!(served.request_with("?token=0123456789abcdef", "").is_ok());
}

/// Without a token of its own, a server that other machines reach has a new one at each start.
#[test]
fn an_address_that_other_machines_reach_has_a_random_token() {
    let bind = |address: &str| Server::bind(address.parse().unwrap(), None).unwrap();
    for address in ["127.0.0.1:0", "127.0.0.2:0"] {
        assert!(!bind(address).address().contains('?'), "only this machine reaches {address}");
    }
    let (server, other) = (bind("0.0.0.0:0"), bind("0.0.0.0:0"));
    let token = |server: &Server| server.address().split_once("/?token=").unwrap().1.to_owned();
    let (own, foreign) = (token(&server), token(&other));
    assert!(own.len() >= 16 && own != foreign, "{own} {foreign}");
    let served = Served::of(None, &Config::default(), Tools::default(), server);
    for query in [String::new(), format!("?token={foreign}")] {
        assert_eq!(served.request_with(&query, "").map(drop), Err("403".to_owned()), "{query}");
    }
    assert!(served.request_with(&format!("?token={own}"), "").is_ok());
}

#[test]
fn a_server_without_a_folder_records_nothing() {
    let served = Served::new(None, &Config::default(), Tools::default());
    let why = served.page().refusal(&json!({"order": "record", "labels": {"specimen": "Saw3"}}));
    assert_eq!(why, "recording is off: start wstac serve with --record-to FOLDER");
}

#[test]
fn there_is_one_job_at_a_time_and_no_baseline_in_a_recording() {
    let folder = tempdir().unwrap();
    let tools = Tools { record_to: Some(folder.path().to_owned()), ..Tools::default() };
    let served = Served::new(None, &Config::default(), tools);
    let (mut page, mut other) = (served.page(), served.page());
    assert_eq!(page.refusal(&json!({"order": "stop"})), "nothing is in progress");
    assert!(page.refusal(&json!({"order": "find"})).contains("there is no calibration in progress"));
    assert!(page.refusal(&json!({"order": "use", "proposal": 1})).contains("there is no calibration in progress"));
    page.record(&json!({}));
    for order in ["record", "calibrate", "examine", "rezero"] {
        let why = other.refusal(&json!({"order": order}));
        assert_eq!(why, "a recording is in progress; end it first", "{order}");
    }
    // Whoever sees the page may end it.
    other.stop();
    page.until("ended", |page| page.jobs["job"].is_null());
    page.order(&json!({"order": "calibrate"}));
    page.until("calibrating", |page| page.jobs["job"]["kind"] == "calibration");
    let why = page.refusal(&json!({"order": "record"}));
    assert_eq!(why, "a calibration is in progress; end it first");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// A message that is longer than any order ends the connection, and nothing else.
#[test]
fn long_messages_are_not_read() {
    let served = Served::new(None, &Config::default(), Tools::default());
    let mut page = served.page();
    page.say(&format!("order 0 {}", "x".repeat(100_000)));
    let closed = loop {
        if let Message::Close(frame) = page.socket.read().unwrap() {
            break frame.unwrap();
        }
    };
    assert_eq!((closed.code, &*closed.reason), (CloseCode::Size, "a message is longer than 1024 bytes"));
    let why = served.page().refusal(&json!({"order": "record"}));
    assert!(why.contains("recording is off"), "{why}");
}

/// No order is taken of a client that reads no answer, and neither other pages nor the end of the server wait for it.
#[test]
fn orders_without_end_hold_up_nobody_else() {
    let served = Served::new(None, &Config::default(), Tools::default());
    let mut flood = served.page();
    let order = format!("order {}", "\"".repeat(1000));
    // 200 MB of answers.
    let flooding = std::thread::spawn(move || (0..100_000).find(|_| flood.socket.send(Message::text(&order)).is_err()));
    served.allow(5);
    served.page().until_frame(5);
    let mut talks = served.page();
    let talking = std::thread::spawn(move || while talks.socket.send(Message::text("nothing")).is_ok() {});
    assert_eq!(served.end().0, 0);
    assert!(flooding.join().unwrap().is_some(), "all orders were taken");
    talking.join().unwrap();
}

/// The 65th page has no place until another one is closed.
#[test]
fn there_are_at_most_64_pages() {
    let served = Served::new(None, &Config::default(), Tools::default());
    let mut pages: Vec<_> = (0..64).map(|_| served.request("").unwrap()).collect();
    assert_eq!(served.request("").map(drop), Err("503".to_owned()));
    pages.pop();
    // The server sees it in a moment.
    assert!((0..500).any(|_| {
        std::thread::sleep(Duration::from_millis(20));
        served.request("").is_ok()
    }));
}

/// Pings that get no reader for their answers are not taken: the answers would wait in memory.
#[test]
fn pings_without_end_take_no_memory() {
    let served = Served::new(None, &Config::default(), Tools::default());
    let mut flood = served.page();
    // After two updates the server waits for the page, and so has nothing else to send.
    served.allow(60);
    std::thread::sleep(Duration::from_secs(1));
    flood.socket.get_mut().set_write_timeout(Some(Duration::from_secs(2))).unwrap();
    let ping = Message::Ping(vec![0; 125].into());
    // The system's buffers take some of them, in both directions.
    let taken = (0..400_000).take_while(|_| flood.socket.send(ping.clone()).is_ok()).count() * 131;
    assert!(taken < 24 << 20, "{taken} bytes of pings were taken");
    assert_eq!(served.end().0, 0);
}

/// Whoever has no token cannot take the places of those who have one: the oldest of its connections goes.
#[test]
fn half_requests_lock_nobody_out() {
    let token = "0123456789abcdef";
    let served = Served::with_token(None, &Config::default(), Tools::default(), Token::new(token, "the token").ok());
    let half = |text: &[u8]| {
        let mut stream = served.connect();
        // One that has gone already is none of the last.
        let _ = stream.write_all(text);
        stream
    };
    let mut halves: Vec<_> = (0..300).map(|_| half(b"GET / HTTP/1.1\r\nHost:")).collect();
    for _ in 0..3 {
        assert!(served.request_with(&format!("?token={token}"), "").is_ok());
        halves.extend((0..100).map(|number| half(&b"GET /page.js HTTP/1.1\r\nA: \r"[..number % 26])));
    }
    let mut bytes = [0; 1];
    assert!(!matches!(halves[0].read(&mut bytes), Ok(1)), "the oldest one is gone");
    drop(halves);
    assert_eq!(served.end().0, 0);
}

/// Requests that come byte by byte are read. An answer arrives although the client has said more, or has nothing more
/// to say.
#[test]
fn slow_and_odd_requests_are_answered() {
    let served = Served::new(None, &Config::default(), Tools::default());
    let answer = |parts: &[&[u8]], ends: bool| {
        let mut stream = served.connect();
        stream.set_nodelay(true).unwrap();
        for part in parts {
            stream.write_all(part).unwrap();
            std::thread::sleep(Duration::from_millis(2));
        }
        if ends {
            stream.shutdown(std::net::Shutdown::Write).unwrap();
        }
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        text.lines().next().unwrap_or_default().to_owned()
    };
    let head = format!("GET / HTTP/1.1\r\nHost: {}\r\n\r\n", served.host());
    let bytes: Vec<&[u8]> = head.as_bytes().chunks(1).collect();
    assert_eq!(answer(&bytes, false), "HTTP/1.1 200 OK");
    assert_eq!(answer(&[head.as_bytes()], true), "HTTP/1.1 200 OK");
    assert_eq!(answer(&bytes[..bytes.len() - 1], true), "", "half a request and no more");
    let long = [head.as_bytes(), &b"x".repeat(100_000)].concat();
    assert_eq!(answer(&[&long], false), "HTTP/1.1 200 OK");
    let post = head.replace("GET", "POST") + &"x".repeat(100_000);
    assert_eq!(answer(&[post.as_bytes()], false), "HTTP/1.1 405 Method Not Allowed");
    assert_eq!(answer(&[&[0x16].repeat(20_000)], false), "HTTP/1.1 400 Bad Request");
    assert_eq!(answer(&[b"GET /", &b"x".repeat(20_000)], false), "HTTP/1.1 431 Request Header Fields Too Large");
}
