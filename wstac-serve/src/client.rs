//! Sends one client what it has not seen, no faster than it takes it.
//!
//! A client acknowledges every update. While too many are not acknowledged, it gets nothing: what it misses is
//! skipped, so that it sees the newest frame as soon as it can take one.

use std::io;
use std::net::TcpStream;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use rustix::event::PollFlags;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{CloseFrame, Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket};

use crate::guest::forget;
use crate::http::is_wait;
use crate::hub::{Cursor, Hub, Joined};
use crate::order::{self, Order, Refused};

/// Time between two updates: 30 per second.
const PERIOD: Duration = Duration::from_micros(33_333);
/// A client that acknowledges nothing for so long, or takes nothing, is gone, unless the program has another patience.
pub(crate) const PATIENCE: Duration = Duration::from_secs(30);
/// Time after which a client without news gets a sign of life.
const QUIET: Duration = Duration::from_secs(2);
/// Most messages that are taken in one look. More wait in the socket, so a client that never stops talking holds up
/// itself alone.
const MOST_AT_ONCE: usize = 64;
/// Most bytes of a message of a client.
const LONGEST: usize = 1024;
/// Bytes that are read at once.
const READ: usize = 4096;
/// Time in which a client that was told why the connection ends may end it itself.
const LEAVING: Duration = Duration::from_millis(500);
/// Most bytes that wait for all clients. An update is far smaller, and another one is not made for a client before it
/// has taken the last.
pub(crate) const MOST_WAITING: usize = 32 << 20;

pub(crate) struct Client<'h> {
    socket: WebSocket<TcpStream>,
    hub: &'h Hub,
    patience: Duration,
    _joined: Joined<'h>,
    /// Bytes that the socket has not taken yet, rounded up to whole messages.
    waiting: usize,
    cursors: Vec<Cursor>,
    /// The sensor whose update is the next of a round.
    next: usize,
    /// Updates that were sent, and those of them that were acknowledged.
    sent: u64,
    acknowledged: u64,
    /// The updates that were sent at the end of each of the last two rounds. A new one begins when the older of them is
    /// acknowledged.
    rounds: [u64; 2],
    /// When the next round begins.
    due: Instant,
    /// The end of the last round.
    last: Instant,
    /// The time of the last acknowledgement, or of sending if there was nothing to acknowledge.
    heard: Instant,
    /// Whether there may be messages that were received and not looked at.
    has_more: bool,
    /// When the connection ends, once the client was told why.
    leaves: Option<Instant>,
    /// The reasons why orders of this client were refused, and where they are sent to.
    refusals: (Sender<Refused>, Receiver<Refused>),
}

impl<'h> Client<'h> {
    /// Greets a client. `rest` came behind its request.
    ///
    /// # Errors
    /// The connection breaks.
    pub(crate) fn new(stream: TcpStream, rest: Vec<u8>, hub: &'h Hub, patience: Duration) -> Result<Self, Error> {
        let config = WebSocketConfig::default()
            .max_message_size(Some(LONGEST))
            .max_frame_size(Some(LONGEST))
            .read_buffer_size(READ)
            .write_buffer_size(0)
            .max_write_buffer_size(MOST_WAITING);
        let now = Instant::now();
        let mut client = Self {
            socket: WebSocket::from_partially_read(stream, rest, Role::Server, Some(config)),
            hub,
            patience,
            _joined: hub.join(),
            waiting: 0,
            cursors: vec![Cursor::default(); hub.sensors()],
            next: 0,
            sent: 0,
            acknowledged: 0,
            rounds: [0; 2],
            due: now,
            last: now,
            heard: now,
            has_more: true,
            leaves: None,
            refusals: channel(),
        };
        client.send(Message::text(hub.hello().map_err(io::Error::other)?))?;
        Ok(client)
    }

    pub(crate) fn stream(&self) -> &TcpStream {
        self.socket.get_ref()
    }

    /// Returns how many bytes wait for the client.
    pub(crate) fn waiting(&self) -> usize {
        self.waiting
    }

    /// Returns what this waits for.
    pub(crate) fn waits_for(&self) -> PollFlags {
        if self.waiting > 0 { PollFlags::OUT } else { PollFlags::IN }
    }

    /// Returns whether this waits for news of a sensor, or has more to do at once.
    pub(crate) fn is_hungry(&self) -> bool {
        self.has_more || self.waiting == 0 && self.may_begin()
    }

    fn may_begin(&self) -> bool {
        self.acknowledged >= self.rounds[0]
    }

    /// Reads and writes what is possible now. A new update is made if `has_room`.
    ///
    /// # Errors
    /// The client is gone, or does not keep to the protocol.
    pub(crate) fn advance(&mut self, is_ready: bool, has_room: bool) -> Result<(), Error> {
        self.flush()?;
        let now = Instant::now();
        if let Some(ends) = self.leaves {
            let is_gone = forget(self.socket.get_mut())? || now >= ends;
            return if is_gone { Err(Error::ConnectionClosed) } else { Ok(()) };
        }
        let is_idle = self.waiting == 0 && self.acknowledged == self.sent;
        if !is_idle && now.duration_since(self.heard) > self.patience {
            return Err(io::Error::from(io::ErrorKind::TimedOut).into());
        }
        if is_ready || self.has_more {
            match self.listen() {
                Err(Error::Capacity(_)) => return self.refuse_long(now),
                listened => listened?,
            }
        }
        self.tell_refusals()?;
        if has_room { self.update(now) } else { Ok(()) }
    }

    /// Ends the connection because the server ends. The page connects again as soon as there is one.
    pub(crate) fn end(mut self) {
        // Whoever takes nothing is not told.
        let _ = self.socket.close(None);
    }

    /// Sends a round of updates, until one waits.
    fn update(&mut self, now: Instant) -> Result<(), Error> {
        if self.next == 0 && !(self.may_begin() && now >= self.due) {
            return Ok(());
        }
        while self.waiting == 0 && self.next < self.cursors.len() {
            let update = self.hub.update(self.next, &mut self.cursors[self.next]);
            self.next += 1;
            if let Some(update) = update {
                self.send_update(update.text().map_err(io::Error::other)?, now)?;
                for picture in update.pictures() {
                    self.send(Message::binary(picture))?;
                }
            }
        }
        if self.next < self.cursors.len() {
            return Ok(());
        }
        self.next = 0;
        if self.sent == self.rounds[1] {
            if now.duration_since(self.last) <= QUIET {
                return Ok(());
            }
            self.send_update("{}".to_owned(), now)?;
        }
        (self.rounds, self.last) = ([self.rounds[1], self.sent], now);
        // A frame that is a little late does not make all later ones late, too.
        self.due = (self.due + PERIOD).max(now.checked_sub(PERIOD / 2).unwrap_or(now));
        Ok(())
    }

    fn send_update(&mut self, text: String, now: Instant) -> Result<(), Error> {
        if self.acknowledged == self.sent {
            self.heard = now;
        }
        self.sent += 1;
        self.send(Message::text(text))
    }

    /// Sends a message, or what fits of it: the rest waits.
    fn send(&mut self, message: Message) -> Result<(), Error> {
        let length = message.len();
        match self.socket.write(message) {
            Err(Error::Io(error)) if is_wait(&error) => self.waiting += length,
            written => written?,
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Error> {
        match self.socket.flush() {
            Ok(()) => self.waiting = 0,
            // Answers to pings wait as well.
            Err(Error::Io(error)) if is_wait(&error) => self.waiting = self.waiting.max(1),
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// Takes messages, unless the client does not take the answers.
    fn listen(&mut self) -> Result<(), Error> {
        for _ in 0..MOST_AT_ONCE {
            self.has_more = self.waiting > 0;
            if self.has_more {
                return Ok(());
            }
            match self.socket.read() {
                Ok(Message::Text(text)) => self.take(&text),
                // A client that does not take the answers to its pings is not heard any more.
                Ok(_) => self.flush()?,
                Err(Error::Io(error)) if is_wait(&error) => return Ok(()),
                Err(error) => return Err(error),
            }
            self.tell_refusals()?;
        }
        self.has_more = true;
        Ok(())
    }

    /// Tells the client that its message was too long, and ends the connection.
    fn refuse_long(&mut self, now: Instant) -> Result<(), Error> {
        let reason = format!("a message is longer than {LONGEST} bytes").into();
        match self.socket.close(Some(CloseFrame { code: CloseCode::Size, reason })) {
            Err(Error::Io(error)) if is_wait(&error) => {}
            closed => closed?,
        }
        // The rest of the message is read and forgotten: bytes that nobody has read would break the connection, and the
        // client would not hear why.
        (self.leaves, self.has_more) = (Some(now + LEAVING), false);
        Ok(())
    }

    /// Tells the client which of its orders were refused, and why, one after the other.
    fn tell_refusals(&mut self) -> Result<(), Error> {
        while self.waiting == 0
            && let Ok(Refused { sensor, why }) = self.refusals.1.try_recv()
        {
            let why = serde_json::to_string(&why).map_err(io::Error::other)?;
            self.send(Message::text(format!(r#"{{"refused":{sensor},"why":{why}}}"#)))?;
        }
        Ok(())
    }

    /// Takes a message of the client: `ok` for an update, or `order N {"order":…}` for sensor N.
    fn take(&mut self, text: &str) {
        if text == "ok" {
            self.heard = Instant::now();
            self.acknowledged = (self.acknowledged + 1).min(self.sent);
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
