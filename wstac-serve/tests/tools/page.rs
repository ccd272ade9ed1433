//! A server in this process, with a client that stands for the page.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tungstenite::protocol::Role;
use tungstenite::{Message, WebSocket};
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_host::output::OutputOptions;
use wstac_host::source::{Source, SourceEvent, StreamInfo};
use wstac_host::station::Station;
use wstac_host::texture::Textures;
use wstac_scene::SceneConfig;
use wstac_scene::source::SceneSource;
use wstac_serve::{ServedSensor, Server, Token, Tools};

/// The longest that anything here may take.
const LIMIT: Duration = Duration::from_mins(2);
/// Dark frames before the slide of [`SCENE`], and all of its frames.
pub(crate) const LEAD_IN: u64 = 100;
/// A slide over a small sensor, after 100 dark frames.
pub(crate) const SCENE: &str =
    "specimen = \"Saw3\"\nspeed = 150\ndirection = 90\nseed = 7\nlead_in = 100\n[sensor]\nsize = [400, 400]";

pub(crate) fn source(scene: &str) -> SceneSource {
    SceneSource::new(&SceneConfig::from_toml("a scene", scene).unwrap()).unwrap()
}

/// A source that gives so many frames, and then waits until it may give more.
struct Gated {
    inner: SceneSource,
    given: u64,
    allowed: Arc<AtomicU64>,
}

impl Source for Gated {
    fn info(&self) -> &StreamInfo {
        self.inner.info()
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        if self.given >= self.allowed.load(Ordering::SeqCst) {
            sleep(Duration::from_millis(1));
            return Ok(SourceEvent::Waiting);
        }
        self.given += 1;
        self.inner.next_event()
    }
}

/// A server with one sensor.
pub(crate) struct Served {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<usize>>,
    allowed: Arc<AtomicU64>,
    host: String,
    told: Arc<Mutex<Vec<String>>>,
}

impl Served {
    pub(crate) fn new(name: Option<&str>, config: &Config, tools: Tools) -> Self {
        Self::with_token(name, config, tools, None)
    }

    pub(crate) fn with_token(name: Option<&str>, config: &Config, tools: Tools, token: Option<Token>) -> Self {
        Self::of(name, config, tools, Server::bind("127.0.0.1:0".parse().unwrap(), token).unwrap())
    }

    /// Serves at an address that was bound. Requests go to it by 127.0.0.1.
    pub(crate) fn of(name: Option<&str>, config: &Config, tools: Tools, server: Server) -> Self {
        Self::played(name, config, tools, server, false, false)
    }

    /// Serves a scene that can be read `again` and again, or that starts again by itself.
    pub(crate) fn film(repeats: bool, tools: Tools) -> Self {
        let server = Server::bind("127.0.0.1:0".parse().unwrap(), None).unwrap();
        Self::played(None, &Config::default(), tools, server, true, repeats)
    }

    fn played(name: Option<&str>, config: &Config, tools: Tools, server: Server, again: bool, repeats: bool) -> Self {
        let allowed = Arc::new(AtomicU64::new(0));
        let source = Gated { inner: source(SCENE), given: 0, allowed: Arc::clone(&allowed) };
        let info = source.info().clone();
        let (config, textures, source) = (config.clone(), Textures::default(), Box::new(source));
        let mut station = Station::new(source, info, config, textures, OutputOptions::LIVE).unwrap();
        let rest = Arc::clone(&allowed);
        let reopen = move || {
            let source = Gated { inner: self::source(SCENE), given: 0, allowed: Arc::clone(&rest) };
            let info = source.info().clone();
            Ok((Box::new(source) as Box<dyn Source>, info))
        };
        if again {
            station = station.reopened_by(Box::new(reopen), repeats);
        }
        let sensor = ServedSensor::new(name, station, tools);
        let port = server.address().split('/').nth(2).unwrap().rsplit(':').next().unwrap().to_owned();
        let host = format!("127.0.0.1:{port}");
        let (stop, told) = (Arc::new(AtomicBool::new(false)), Arc::new(Mutex::new(Vec::new())));
        let (stops, lines) = (Arc::clone(&stop), Arc::clone(&told));
        let thread = spawn(move || {
            let tell = |_: Option<&str>, line: &str| {
                lines.lock().unwrap_or_else(PoisonError::into_inner).push(line.to_owned());
            };
            server.run(vec![sensor], &stops, &tell)
        });
        Self { stop, thread: Some(thread), allowed, host, told }
    }

    /// Lets the source give its frames up to this number.
    pub(crate) fn allow(&self, frames: u64) {
        self.allowed.store(frames, Ordering::SeqCst);
    }

    pub(crate) fn host(&self) -> &str {
        &self.host
    }

    /// Opens a connection and says nothing.
    pub(crate) fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(LIMIT)).unwrap();
        stream
    }

    /// Opens a page.
    pub(crate) fn page(&self) -> Page {
        let stream = self.request(&format!("Origin: http://{}\r\n", self.host)).unwrap();
        stream.set_read_timeout(Some(LIMIT)).unwrap();
        let socket = WebSocket::from_raw_socket(stream, Role::Client, None);
        let mut page = Page {
            socket,
            jobs: Value::Null,
            status: Value::Null,
            records: Vec::new(),
            about: Value::Null,
            asked: String::new(),
        };
        let mut hello = page.next();
        assert!(hello["sensors"].is_array(), "{hello}");
        page.about = hello["sensors"][0].take();
        page
    }

    /// Asks for a WebSocket with these headers besides.
    ///
    /// # Errors
    /// The status, if there is none.
    pub(crate) fn request(&self, headers: &str) -> Result<TcpStream, String> {
        self.request_with("", headers)
    }

    /// Asks for a WebSocket with this query in the address.
    ///
    /// # Errors
    /// The status, if there is none.
    pub(crate) fn request_with(&self, query: &str, headers: &str) -> Result<TcpStream, String> {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        let head = format!(
            "GET /socket{query} HTTP/1.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        );
        let host = if headers.contains("Host:") { String::new() } else { format!("Host: {}\r\n", self.host) };
        write!(stream, "{head}Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n{host}{headers}\r\n").unwrap();
        let mut answer = Vec::new();
        while !answer.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            assert_eq!(stream.read(&mut byte).unwrap(), 1, "the answer ended early");
            answer.push(byte[0]);
        }
        let answer = String::from_utf8(answer).unwrap();
        let status = answer.split(' ').nth(1).unwrap().to_owned();
        if status == "101" { Ok(stream) } else { Err(status) }
    }

    /// Ends the server as a signal does. Returns how many sensors have failed, and the lines that it told.
    pub(crate) fn end(mut self) -> (usize, Vec<String>) {
        self.stop.store(true, Ordering::SeqCst);
        let failures = self.thread.take().unwrap().join().unwrap();
        (failures, self.told.lock().unwrap().clone())
    }
}

/// Also after a test that has failed, so that it ends.
impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
    }
}

/// A client that stands for the page.
pub(crate) struct Page {
    pub(crate) socket: WebSocket<TcpStream>,
    /// The jobs that the page would show.
    pub(crate) jobs: Value,
    pub(crate) status: Value,
    /// The records that it would list.
    pub(crate) records: Vec<Value>,
    pub(crate) about: Value,
    /// The last order.
    asked: String,
}

/// Why an order is refused that comes before a sensor has taken the one before it.
const EARLY: &str = "another order waits: try again";

impl Page {
    /// Returns the next message, and acknowledges it if it is an update.
    fn next(&mut self) -> Value {
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else { continue };
            let mut message: Value = serde_json::from_str(&text).unwrap();
            if message["why"] == EARLY {
                self.socket.send(Message::text(&self.asked)).unwrap();
                continue;
            }
            if message.get("sensors").is_none() && message.get("refused").is_none() {
                self.socket.send(Message::text("ok")).unwrap();
            }
            if message.get("update").is_some() {
                let Value::Array(records) = message["records"].take() else { panic!("{message}") };
                if self.status["backs"] != message["status"]["backs"] {
                    self.records.clear();
                }
                self.records.extend(records);
                self.status = message["status"].take();
                if !message["jobs"].is_null() {
                    self.jobs = message["jobs"].take();
                }
            }
            return message;
        }
    }

    /// Sends a message as it is.
    pub(crate) fn say(&mut self, text: &str) {
        self.socket.send(Message::text(text)).unwrap();
    }

    /// Gives an order, again if it comes too early.
    pub(crate) fn order(&mut self, action: &Value) {
        self.asked = format!("order 0 {action}");
        self.say(&self.asked.clone());
    }

    /// Waits until the page shows something.
    pub(crate) fn until(&mut self, what: &str, is: impl Fn(&Self) -> bool) {
        let start = Instant::now();
        while !is(self) {
            assert!(start.elapsed() < LIMIT, "never {what}: {} {}", self.jobs, self.status);
            self.next();
        }
    }

    /// Waits until this many frames were read.
    pub(crate) fn until_frame(&mut self, frame: u64) {
        self.until("the frame", |page| page.status["frame"].as_u64() >= Some(frame));
    }

    /// Gives an order that is to be refused, and returns why.
    pub(crate) fn refusal(&mut self, action: &Value) -> String {
        self.refusal_of(&format!("order 0 {action}"))
    }

    /// Sends a message that is to be refused, and returns why.
    pub(crate) fn refusal_of(&mut self, text: &str) -> String {
        self.say(text);
        let start = Instant::now();
        loop {
            assert!(start.elapsed() < LIMIT, "{text} was not refused: {}", self.jobs);
            let message = self.next();
            if message.get("refused").is_some() {
                return message["why"].as_str().unwrap().to_owned();
            }
        }
    }

    /// Starts a recording with these labels.
    pub(crate) fn record(&mut self, labels: &Value) {
        self.order(&json!({"order": "record", "labels": labels}));
        self.until("recording", |page| page.jobs["job"]["kind"] == "recording");
    }

    /// Ends the job in progress.
    pub(crate) fn stop(&mut self) {
        self.order(&json!({"order": "stop"}));
        self.until("ended", |page| page.jobs["job"].is_null());
    }
}
