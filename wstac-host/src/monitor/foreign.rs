//! What comes out of a port that is not of WSTac's link, in words for people.

use std::time::{Duration, Instant};

use wstac_core::wire::{Decoder, LONGEST_REQUEST, Request};

/// The time for which a port may send bytes without a message: a board sends its state about once per second, and
/// nothing for 3.2 s after its camera's clock was divided.
const LATE: Duration = Duration::from_secs(4);

/// The bytes of a port, of which none has been a message so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Foreign {
    requests: Decoder<LONGEST_REQUEST>,
    /// When the first byte came.
    since: Option<Instant>,
    pub(super) count: u64,
    zeros: u64,
    printable: u64,
    has_echo: bool,
}

impl Foreign {
    /// Takes a byte. Returns whether it ends a request: no board sends any, so the port sends back what it is sent.
    pub(super) fn take(&mut self, byte: u8) -> bool {
        self.since.get_or_insert_with(Instant::now);
        self.count += 1;
        self.zeros += u64::from(byte == 0);
        self.printable += u64::from(byte.is_ascii_graphic() || byte.is_ascii_whitespace());
        let is_echo = matches!(self.requests.push::<Request>(byte), Some(Ok(_)));
        self.has_echo |= is_echo;
        is_echo
    }

    /// Returns whether it is sure by now that the port is not that of a board.
    pub(super) fn is_sure(&self) -> bool {
        self.since.is_some_and(|since| since.elapsed() >= LATE)
    }

    /// Returns what the port has instead of messages, and what to check first.
    pub(super) fn in_words(&self) -> String {
        let most_are = |some: u64| 20 * some >= 19 * self.count;
        let [found, first] = if self.count == 0 {
            ["no bytes", "the board's power and cable, then the wires TX, RX and GND, then which port it is"]
        } else if self.has_echo {
            ["its own requests", "that TX and RX are not connected to each other, then which port it is"]
        } else if most_are(self.zeros) {
            ["zeros", "the wires TX and GND and the board's power, then --baud"]
        } else if most_are(self.printable) {
            ["text", "which port it is: another program writes to this one"]
        } else {
            ["other bytes", "--baud, then which port it is"]
        };
        format!("has no messages (found {found}, expected those of a board); help: check {first}")
    }
}

#[cfg(test)]
mod tests {
    use wstac_core::wire::{LONGEST, encode};

    use super::*;

    fn found(bytes: &[u8]) -> String {
        let mut foreign = Foreign::default();
        for &byte in bytes {
            foreign.take(byte);
        }
        foreign.in_words()
    }

    #[test]
    fn zeros_text_echoes_and_noise_are_told_apart() {
        let noise: Vec<u8> = (0..=u8::MAX).rev().collect();
        let mut buffer = [0; LONGEST];
        let echo = [&noise[..], &[0], encode(&Request::Hello, 0, &mut buffer)].concat();
        for (bytes, expected) in [
            (&[][..], "found no bytes, "),
            (&[0; 99][..], "found zeros, "),
            (&b"[    0.000000] Booting Linux\r\n"[..], "found text, "),
            (&noise[..], "found other bytes, "),
            (&echo[..], "found its own requests, "),
        ] {
            assert!(found(bytes).contains(expected), "{}, expected {expected}", found(bytes));
        }
    }

    #[test]
    fn it_takes_two_seconds_to_be_sure() {
        let mut foreign = Foreign::default();
        assert!(!foreign.is_sure());
        foreign.take(7);
        assert!(!foreign.is_sure());
        foreign.since = Instant::now().checked_sub(LATE);
        assert!(foreign.is_sure());
    }

    #[test]
    fn the_end_of_a_request_is_known() {
        let (mut foreign, mut buffer) = (Foreign::default(), [0; LONGEST]);
        let ends: Vec<_> =
            encode(&Request::Features(true), 3, &mut buffer).iter().map(|&byte| foreign.take(byte)).collect();
        assert_eq!(ends.iter().filter(|&&end| end).count(), 1);
        assert_eq!(ends.last(), Some(&true));
    }
}
