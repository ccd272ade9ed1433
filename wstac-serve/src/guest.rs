//! A connection before it is admitted: it asks, gets one answer, and goes. Nobody waits for it.

use std::io::{self, IoSlice, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use rustix::event::PollFlags;

use crate::access::Access;
use crate::http::{Answer, HttpRefusal, LONGEST_HEAD, Request, is_wait, refuse};
use crate::page;

/// Time that a client has to send the head of its request, and again to take the answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// Time in which a client that has its answer may go by itself.
const LEAVING: Duration = Duration::from_millis(500);
/// Most reads of bytes that nobody wants, in one look.
const MOST_AT_ONCE: usize = 16;

/// A connection that is not admitted.
pub(crate) struct Guest {
    pub(crate) stream: TcpStream,
    stage: Stage,
    /// When this stage ends at the latest.
    ends: Instant,
}

enum Stage {
    /// The head of the request so far.
    Asking(Vec<u8>),
    /// The answer, and how many of its bytes were sent.
    Answering(Answer, usize),
    Leaving,
}

/// The next state of a guest.
pub(crate) enum Fate {
    Stays,
    Goes,
    /// It may have a WebSocket with this key. The bytes came behind the request.
    Joins(String, Vec<u8>),
}

impl Guest {
    /// Takes a connection.
    ///
    /// # Errors
    /// It is gone already.
    pub(crate) fn new(stream: TcpStream) -> io::Result<Self> {
        stream.set_nonblocking(true)?;
        stream.set_nodelay(true)?;
        Ok(Self { stream, stage: Stage::Asking(Vec::new()), ends: Instant::now() + PATIENCE })
    }

    /// Returns what this waits for.
    pub(crate) fn waits_for(&self) -> PollFlags {
        if matches!(self.stage, Stage::Answering(..)) { PollFlags::OUT } else { PollFlags::IN }
    }

    /// Reads or writes what is possible now, if it `is_ready` or if its time is over.
    pub(crate) fn advance(&mut self, is_ready: bool, access: &Access) -> Fate {
        let is_late = Instant::now() >= self.ends;
        if !(is_ready || is_late) {
            return Fate::Stays;
        }
        let fate = match &mut self.stage {
            Stage::Asking(_) if is_late => {
                self.answer(refuse(HttpRefusal::new(408, "the request did not end in time")))
            }
            Stage::Asking(_) => self.ask(access),
            _ if is_late => Ok(Fate::Goes),
            Stage::Answering(..) => self.send(),
            Stage::Leaving => forget(&mut self.stream).map(|is_gone| if is_gone { Fate::Goes } else { Fate::Stays }),
        };
        // A connection that breaks is the client's affair.
        fate.unwrap_or(Fate::Goes)
    }

    fn ask(&mut self, access: &Access) -> io::Result<Fate> {
        let Stage::Asking(bytes) = &mut self.stage else { return Ok(Fate::Stays) };
        let (mut part, before) = ([0; 2048], bytes.len());
        match self.stream.read(&mut part) {
            Ok(0) => return Ok(Fate::Goes),
            Ok(count) => bytes.extend_from_slice(&part[..count]),
            Err(error) if is_wait(&error) => return Ok(Fate::Stays),
            Err(error) => return Err(error),
        }
        // Whoever sends a head byte by byte does not have it parsed as often.
        let is_line = |pair: &[u8]| pair == b"\n\n" || pair == b"\n\r";
        let may_end = bytes[before.saturating_sub(2)..].windows(2).any(is_line);
        if before > 0 && !may_end && bytes.len() < LONGEST_HEAD {
            return Ok(Fate::Stays);
        }
        let answer = match Request::parse(bytes) {
            Ok(None) => return Ok(Fate::Stays),
            Ok(Some((request, length))) => match (access.check(&request), request.key.clone()) {
                (Err(refusal), _) => refuse(refusal),
                (Ok(()), Some(key)) => return Ok(Fate::Joins(key, bytes.split_off(length))),
                (Ok(()), None) => match page::file(&request.path) {
                    Some((kind, body)) => request.answer(kind, body),
                    None => refuse(HttpRefusal::new(404, "there is no such page")),
                },
            },
            Err(refusal) => refuse(refusal),
        };
        self.answer(answer)
    }

    /// Begins an answer.
    ///
    /// # Errors
    /// The connection breaks.
    pub(crate) fn answer(&mut self, answer: Answer) -> io::Result<Fate> {
        (self.stage, self.ends) = (Stage::Answering(answer, 0), Instant::now() + PATIENCE);
        self.send()
    }

    fn send(&mut self) -> io::Result<Fate> {
        let Stage::Answering((head, body), sent) = &mut self.stage else { return Ok(Fate::Stays) };
        while *sent < head.len() + body.len() {
            let parts = [&head[(*sent).min(head.len())..], &body[sent.saturating_sub(head.len())..]];
            match self.stream.write_vectored(&parts.map(IoSlice::new)) {
                Ok(count) => *sent += count,
                Err(error) if is_wait(&error) => return Ok(Fate::Stays),
                Err(error) => return Err(error),
            }
        }
        // Bytes that nobody has read would break the connection, and the client might not get its answer.
        self.stream.shutdown(std::net::Shutdown::Write)?;
        (self.stage, self.ends) = (Stage::Leaving, Instant::now() + LEAVING);
        Ok(Fate::Stays)
    }
}

/// Reads bytes that nobody wants. Returns whether the client is gone.
///
/// # Errors
/// The connection breaks.
pub(crate) fn forget(stream: &mut TcpStream) -> io::Result<bool> {
    let mut forgotten = [0; 4096];
    for _ in 0..MOST_AT_ONCE {
        match stream.read(&mut forgotten) {
            Ok(0) => return Ok(true),
            Ok(_) => {}
            Err(error) if is_wait(&error) => break,
            Err(error) => return Err(error),
        }
    }
    Ok(false)
}
