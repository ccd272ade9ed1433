//! Sends one client what it has not seen, no faster than it takes it.
//!
//! A client acknowledges every update. While too many are not acknowledged, it gets nothing: what it misses is
//! skipped, so that it sees the newest frame as soon as it can take one.

use std::io::{self, Read};
use std::net::TcpStream;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{CloseFrame, Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

use crate::http::is_wait;
use crate::hub::{Cursor, Hub, Update};
use crate::order::{self, Order, Refused};

/// Time between two updates: 30 per second.
const PERIOD: Duration = Duration::from_micros(33_333);
/// Rounds of updates that are sent before the first of them is acknowledged.
const WINDOW: usize = 2;
/// The longest wait between two looks at what the client says.
const WAIT: Duration = Duration::from_millis(20);
/// A client that acknowledges nothing for so long is gone.
const PATIENCE: Duration = Duration::from_secs(30);
/// Time after which a client without news gets a sign of life.
const QUIET: Duration = Duration::from_secs(2);
/// Most messages that are taken in one look. More wait in the socket, so a client that never stops talking holds up itself
/// alone.
const MOST_AT_ONCE: usize = 64;
/// Most bytes of a message of a client.
const LONGEST: usize = 1024;
/// Time in which a client that was told why the connection ends may end it itself.
const LEAVING: Duration = Duration::from_millis(500);
/// Most bytes that wait for a client: the first round of many sensors is far smaller.
const MOST_WAITING: usize = 16 << 20;

struct Client<'h> {
    socket: WebSocket<TcpStream>,
    hub: &'h Hub,
    /// Messages that wait for an acknowledgement, by round.
    unacknowledged: Vec<usize>,
    /// The time of the last acknowledgement, or of sending if there was nothing to acknowledge.
    heard: Instant,
    /// The reasons why orders of this client were refused, and where they are sent to.
    refusals: (Sender<Refused>, Receiver<Refused>),
}

/// Serves a client until it is gone or the server ends. `rest` came behind its request.
///
/// # Errors
/// The connection breaks, or the client does not keep to the protocol.
pub(crate) fn serve(stream: TcpStream, rest: Vec<u8>, hub: &Hub) -> Result<(), Error> {
    stream.set_nonblocking(true)?;
    stream.set_nodelay(true)?;
    let config = WebSocketConfig::default()
        .max_message_size(Some(LONGEST))
        .max_frame_size(Some(LONGEST))
        .max_write_buffer_size(MOST_WAITING);
    let socket = WebSocket::from_partially_read(stream, rest, Role::Server, Some(config));
    let _joined = hub.join();
    let mut client = Client { socket, hub, unacknowledged: Vec::new(), heard: Instant::now(), refusals: channel() };
    client.send(Message::text(hub.hello().map_err(io::Error::other)?))?;
    match client.run() {
        Err(Error::Capacity(_)) => client.refuse_long(),
        ended => ended,
    }
}

impl Client<'_> {
    fn run(&mut self) -> Result<(), Error> {
        let (mut cursors, mut due, mut sent) = (Vec::new(), Instant::now(), Instant::now());
        while !self.hub.is_over() {
            self.listen()?;
            self.tell_refusals()?;
            let now = Instant::now();
            let is_free = self.unacknowledged.len() < WINDOW;
            if is_free && now >= due {
                let is_quiet = now.duration_since(sent) > QUIET;
                if self.update(&mut cursors, is_quiet)? {
                    sent = now;
                    // A frame that is a little late does not make all later ones late, too.
                    due = (due + PERIOD).max(now.checked_sub(PERIOD / 2).unwrap_or(now));
                }
            }
            self.flush()?;
            if !self.unacknowledged.is_empty() && self.heard.elapsed() > PATIENCE {
                return Err(io::Error::from(io::ErrorKind::TimedOut).into());
            }
            self.hub.wait(WAIT);
        }
        // The page connects again as soon as there is a server.
        allow_wait(self.socket.close(None))?;
        self.flush()
    }

    /// Sends a round of updates, and returns whether there was one.
    fn update(&mut self, cursors: &mut Vec<Cursor>, is_quiet: bool) -> Result<bool, Error> {
        let updates = self.hub.updates(cursors);
        let mut texts = Vec::with_capacity(updates.len());
        for update in &updates {
            texts.push(update.text().map_err(io::Error::other)?);
        }
        if texts.is_empty() && is_quiet {
            texts.push("{}".to_owned());
        }
        if texts.is_empty() {
            return Ok(false);
        }
        if self.unacknowledged.is_empty() {
            self.heard = Instant::now();
        }
        self.unacknowledged.push(texts.len());
        for (index, text) in texts.into_iter().enumerate() {
            self.send(Message::text(text))?;
            for picture in updates.get(index).into_iter().flat_map(Update::pictures) {
                self.send(Message::binary(picture))?;
            }
        }
        Ok(true)
    }

    fn send(&mut self, message: Message) -> Result<(), Error> {
        allow_wait(self.socket.write(message))
    }

    fn flush(&mut self) -> Result<(), Error> {
        allow_wait(self.socket.flush())
    }

    fn listen(&mut self) -> Result<(), Error> {
        for _ in 0..MOST_AT_ONCE {
            match self.socket.read() {
                Ok(Message::Text(text)) => self.take(&text),
                Ok(_) => {}
                Err(Error::Io(error)) if is_wait(&error) => return Ok(()),
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Tells the client that its message was too long, and ends the connection.
    fn refuse_long(&mut self) -> Result<(), Error> {
        let reason = format!("a message is longer than {LONGEST} bytes").into();
        allow_wait(self.socket.close(Some(CloseFrame { code: CloseCode::Size, reason })))?;
        // The rest of the message is read and forgotten: bytes that nobody has read would break the connection, and the
        // client would not hear why.
        let (start, mut forgotten) = (Instant::now(), [0; 4096]);
        while start.elapsed() < LEAVING && !self.hub.is_over() {
            self.flush()?;
            match self.socket.get_mut().read(&mut forgotten) {
                Ok(0) => break,
                Ok(_) => {}
                Err(error) if is_wait(&error) => self.hub.wait(WAIT),
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }

    /// Tells the client which of its orders were refused, and why.
    fn tell_refusals(&mut self) -> Result<(), Error> {
        while let Ok(Refused { sensor, why }) = self.refusals.1.try_recv() {
            let why = serde_json::to_string(&why).map_err(io::Error::other)?;
            self.send(Message::text(format!(r#"{{"refused":{sensor},"why":{why}}}"#)))?;
        }
        Ok(())
    }

    /// Takes a message of the client: `ok` for an update, or `order N {"order":…}` for sensor N.
    fn take(&mut self, text: &str) {
        if text == "ok" {
            self.heard = Instant::now();
            if let Some(first) = self.unacknowledged.first_mut() {
                *first -= 1;
                if *first == 0 {
                    self.unacknowledged.remove(0);
                }
            }
        } else if let Some(order) = text.strip_prefix("order ") {
            let refused = self.refusals.0.clone();
            match order::parse(order) {
                Ok((sensor, action)) => self.hub.ask(sensor, Order { action, refused }),
                // It comes back to this client.
                Err(why) => drop(refused.send(why)),
            }
        }
        // A page of another version may say more.
    }
}

/// Takes a wait for room as success: what was written is kept and sent later.
fn allow_wait(result: Result<(), Error>) -> Result<(), Error> {
    match result {
        Err(Error::Io(error)) if is_wait(&error) => Ok(()),
        result => result,
    }
}
