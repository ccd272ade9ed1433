//! The requests that wait for a board.

use std::collections::VecDeque;
use std::mem;

use wstac_core::wire::{LONGEST, Request, encode};

use super::port::Port;

/// The most requests that wait for a board that does not read.
const MOST_WAITING: usize = 16;

/// Keeps requests until the port takes them, and sends the oldest first.
#[derive(Clone, Debug, Default)]
pub struct Requests {
    sequence: u16,
    waiting: VecDeque<Request>,
    /// Whether the port has not taken the oldest one.
    stuck: bool,
}

/// A change in whether a board reads requests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// It does not read them any more. They wait.
    Stopped,
    /// It reads them again, and none waits.
    Again,
}

impl Reading {
    /// Returns a note for people about the port with this name.
    pub fn in_words(self, port: &str) -> String {
        match self {
            Self::Stopped => format!("{port} does not read requests; they are sent when it does"),
            Self::Again => format!("{port} reads requests again"),
        }
    }
}

impl Requests {
    /// Adds a request. One of the same kind that still waits is out of date.
    pub fn push(&mut self, request: Request) {
        let is_same = |waiting: &Request| match request {
            Request::Acknowledge { .. } => *waiting == request,
            _ => mem::discriminant(waiting) == mem::discriminant(&request),
        };
        self.waiting.retain(|waiting| !is_same(waiting));
        self.waiting.truncate(MOST_WAITING - 1);
        self.waiting.push_back(request);
    }

    /// Sends as many as the port takes now. Returns a change to tell people about.
    pub fn send(&mut self, port: &mut Port) -> Option<Reading> {
        while let Some(request) = self.waiting.front() {
            if !port.send(encode(request, self.sequence, &mut [0; LONGEST])) {
                return (!mem::replace(&mut self.stuck, true)).then_some(Reading::Stopped);
            }
            self.sequence = self.sequence.wrapping_add(1);
            self.waiting.pop_front();
        }
        mem::take(&mut self.stuck).then_some(Reading::Again)
    }
}

impl Extend<Request> for Requests {
    fn extend<T: IntoIterator<Item = Request>>(&mut self, requests: T) {
        requests.into_iter().for_each(|request| self.push(request));
    }
}
