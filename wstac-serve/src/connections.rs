//! All connections, which one thread serves: nobody who is slow takes a thread, or more memory than all may have.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::iter::once;
use std::net::TcpListener;
use std::thread;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::net::sockopt::set_socket_send_buffer_size;
use tungstenite::handshake::derive_accept_key;

use crate::access::Access;
use crate::client::{Client, MOST_WAITING};
use crate::guest::{Fate, Guest};
use crate::http::{HttpRefusal, refuse};
use crate::hub::Hub;

/// Most pages at once.
const MOST: usize = 64;
/// Most connections that have not asked yet, or get their answer. The oldest one goes for a new one.
const MOST_GUESTS: usize = 128;
/// Most connections that are taken in one look.
const MOST_AT_ONCE: usize = 32;
/// Bytes that the system keeps for a connection.
const SENDING: usize = 128 << 10;
/// The longest wait between two checks for the end, and between two looks for news.
const WAIT: Timespec = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };
const LOOK: Timespec = Timespec { tv_sec: 0, tv_nsec: 5_000_000 };
/// A pause after a failure to take a connection, such as too many open files.
const PAUSE: Duration = Duration::from_millis(50);

/// The connections of a server.
pub(crate) struct Connections<'h> {
    listener: &'h TcpListener,
    access: &'h Access,
    hub: &'h Hub,
    /// The time until a page that acknowledges nothing goes.
    patience: Duration,
    guests: VecDeque<Guest>,
    clients: Vec<Client<'h>>,
}

impl<'h> Connections<'h> {
    pub(crate) fn new(listener: &'h TcpListener, access: &'h Access, hub: &'h Hub, patience: Duration) -> Self {
        Self { listener, access, hub, patience, guests: VecDeque::new(), clients: Vec::new() }
    }

    /// Waits until anything is possible, a short time at most, and does it.
    pub(crate) fn advance(&mut self) {
        let waits = |stream, flags| PollFd::new(stream, flags);
        let clients = self.clients.iter().map(|client| waits(client.stream(), client.waits_for()));
        let guests = self.guests.iter().map(|guest| waits(&guest.stream, guest.waits_for()));
        let mut all: Vec<_> = once(PollFd::new(self.listener, PollFlags::IN)).chain(clients).chain(guests).collect();
        let wait = if self.clients.iter().any(Client::is_hungry) { LOOK } else { WAIT };
        // An error of a connection shows again when it is used.
        let _ = poll(&mut all, Some(&wait));
        let ready: Vec<bool> = all.iter().map(|one| !one.revents().is_empty()).collect();
        let (clients, guests) = ready[1..].split_at(self.clients.len());
        self.advance_clients(clients);
        for is_ready in guests {
            // Each goes to the end of the queue, so that their order stays.
            if let Some(guest) = self.guests.pop_front() {
                self.advance_guest(guest, *is_ready);
            }
        }
        if ready[0] {
            self.accept();
        }
    }

    fn advance_clients(&mut self, ready: &[bool]) {
        let (mut ready, mut waiting) = (ready.iter(), self.clients.iter().map(Client::waiting).sum::<usize>());
        self.clients.retain_mut(|client| {
            waiting -= client.waiting();
            // A connection that breaks is the client's affair.
            let stays = client.advance(ready.next() == Some(&true), waiting < MOST_WAITING).is_ok();
            waiting += if stays { client.waiting() } else { 0 };
            stays
        });
    }

    fn advance_guest(&mut self, mut guest: Guest, is_ready: bool) {
        match guest.advance(is_ready, self.access) {
            Fate::Stays => self.guests.push_back(guest),
            Fate::Goes => {}
            Fate::Joins(key, rest) if self.clients.len() < MOST => {
                // A connection that breaks is the client's affair.
                if let Ok(client) = join(guest, &key, rest, self.hub, self.patience) {
                    self.clients.push(client);
                }
            }
            Fate::Joins(..) => {
                if guest.answer(refuse(HttpRefusal::new(503, "too many connections are open"))).is_ok() {
                    self.guests.push_back(guest);
                }
            }
        }
    }

    fn accept(&mut self) {
        for _ in 0..MOST_AT_ONCE {
            match self.listener.accept() {
                Ok((stream, _)) => {
                    // The system's own buffers are memory, too.
                    let _ = set_socket_send_buffer_size(&stream, SENDING);
                    if self.guests.len() >= MOST_GUESTS {
                        self.guests.pop_front();
                    }
                    // Most requests are there already.
                    if let Ok(guest) = Guest::new(stream) {
                        self.advance_guest(guest, true);
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) => {
                    let lacks_files = matches!(Errno::from_io_error(&error), Some(Errno::MFILE | Errno::NFILE));
                    // A file for the next one.
                    if !lacks_files || self.guests.pop_front().is_none() {
                        thread::sleep(PAUSE);
                    }
                    break;
                }
            }
        }
    }

    /// Ends all connections.
    pub(crate) fn end(self) {
        self.clients.into_iter().for_each(Client::end);
    }
}

/// Makes a client of a guest that may have a WebSocket.
fn join<'h>(
    guest: Guest,
    key: &str,
    rest: Vec<u8>,
    hub: &'h Hub,
    patience: Duration,
) -> Result<Client<'h>, tungstenite::Error> {
    let (accept, mut stream) = (derive_accept_key(key.as_bytes()), guest.stream);
    let head = "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n";
    // Nothing was sent before, so there is room for it.
    stream.write_all(format!("{head}Sec-WebSocket-Accept: {accept}\r\n\r\n").as_bytes())?;
    Client::new(stream, rest, hub, patience)
}
