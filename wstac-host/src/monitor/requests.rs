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

    /// Sends as many as the port takes now. If the board stops reading them or reads them again, returns a note for
    /// people.
    pub fn send(&mut self, port: &mut Port) -> Option<String> {
        while let Some(request) = self.waiting.front() {
            if !port.send(encode(request, self.sequence, &mut [0; LONGEST])) {
                let is_new = !mem::replace(&mut self.stuck, true);
                return is_new.then(|| format!("{} does not read requests; they are sent when it does", port.name()));
            }
            self.sequence = self.sequence.wrapping_add(1);
            self.waiting.pop_front();
        }
        mem::take(&mut self.stuck).then(|| format!("{} reads requests again", port.name()))
    }
}

impl Extend<Request> for Requests {
    fn extend<T: IntoIterator<Item = Request>>(&mut self, requests: T) {
        requests.into_iter().for_each(|request| self.push(request));
    }
}
